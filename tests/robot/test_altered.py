"""Perturbed bodies and floors of the robot."""

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.altered import alter
from spikeport.robot.description import MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.perturbed_plant import PerturbedPlant


def built(**perturbed):
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    alter(spec, Perturbation(**perturbed))
    return spec.compile()


@pytest.fixture(scope="module")
def own():
    return built()


def test_without_a_perturbation_the_body_is_the_robots(own):
    whole = mujoco.MjModel.from_xml_path(str(MODEL_PATH))
    np.testing.assert_allclose(own.body_mass, whole.body_mass)
    np.testing.assert_allclose(own.actuator_forcerange, whole.actuator_forcerange)


def test_masses_and_inertias_are_scaled_together(own):
    heavy = built(mass=1.2)
    np.testing.assert_allclose(heavy.body_mass, 1.2 * own.body_mass)
    np.testing.assert_allclose(heavy.body_inertia, 1.2 * own.body_inertia, rtol=1e-6)


def test_the_torso_carries_a_payload_and_its_centre_moves(own):
    loaded = built(payload=5.0, com_x=0.05)
    torso = own.body("torso_link").id
    assert loaded.body_mass[torso] - own.body_mass[torso] == pytest.approx(5.0)
    np.testing.assert_allclose(loaded.body_ipos[torso] - own.body_ipos[torso], [0.05, 0, 0])


def test_strength_scales_torque_limits_and_friction_sets_the_floors(own):
    weak = built(strength=0.5, friction=0.3)
    np.testing.assert_allclose(weak.actuator_forcerange, 0.5 * own.actuator_forcerange)
    floor = weak.geom("floor")
    assert floor.friction[0] == 0.3
    assert floor.priority[0] == 1


def test_a_robot_of_strength_0_has_no_torque_and_falls():
    weak, nominal = PerturbedPlant(Perturbation(strength=0.0)), PerturbedPlant(Perturbation())
    for _ in range(100):
        weak.step()
        nominal.step()
        assert np.abs(weak.data.actuator_force).max() < 1e-6
    assert weak.height_m < 0.7 < nominal.height_m


def test_unitrees_urdf_is_heavier_and_symmetric(own):
    urdf = built(robot_model="urdf")
    assert urdf.body_mass.sum() == pytest.approx(59.3, abs=0.1)
    assert own.body_mass.sum() == pytest.approx(51.4, abs=0.1)
    left, right = urdf.body("left_knee_link"), urdf.body("right_knee_link")
    assert left.mass[0] == right.mass[0]
    np.testing.assert_allclose(left.ipos * [1, -1, 1], right.ipos)


def test_a_payload_that_leaves_no_torso_is_refused():
    built(mass=0.6, payload=-10.0)
    with pytest.raises(UsageError) as caught:
        built(mass=0.5, payload=-10.0)
    assert str(caught.value) == (
        "payload=-10: the torso weighs 8.9 kg with mass=0.5, so nothing would be left of it; "
        "cure: a larger payload"
    )
