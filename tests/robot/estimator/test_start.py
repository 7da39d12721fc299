import numpy as np
import pytest

from spikeport.robot.engine import mujoco
from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import WAIST, Legs
from spikeport.robot.estimator.simulated_sensors import SimulatedSensors
from spikeport.robot.estimator.start import Start, start
from spikeport.robot.plant import Plant
from spikeport.robot.state import PELVIS


def started(plant: Plant, fix: Fix | None = None) -> Start:
    legs, sensors = Legs(), SimulatedSensors(plant).read()
    return start(sensors, legs.soles(sensors.q).points, legs.radii_m, fix)


def heading(begun: Start, plant: Plant) -> float:
    waist_rad = plant.data.qpos[7 + WAIST]
    return torso.heading_rad(torso.pelvis_rotation(begun.rotation, waist_rad))


def test_a_robot_starts_above_the_origin_with_its_soles_on_the_floor():
    plant = Plant()
    begun = started(plant)
    np.testing.assert_allclose(begun.position, [0.0, 0.0, plant.data.qpos[2]], atol=1e-3)
    assert begun.floor_m == 0.0
    np.testing.assert_allclose(begun.rotation, plant.data.body("torso_link").xmat.reshape(3, 3))


def test_a_fix_sets_place_and_heading_and_the_height_of_the_floor():
    plant = Plant()
    place = np.array([1.0, -2.0, plant.data.qpos[2] + 3.0])
    plant.data.qpos[3:7] = np.cos(0.2), 0.0, 0.0, np.sin(0.2)
    mujoco.mj_forward(plant.model, plant.data)
    begun = started(plant, Fix(place, 0.7))
    np.testing.assert_array_equal(begun.position, place)
    assert heading(begun, plant) == pytest.approx(0.7)
    assert begun.floor_m == pytest.approx(3.0, abs=1e-3)


def test_a_fix_without_a_heading_keeps_the_imus_heading():
    plant = Plant()
    begun = started(plant, Fix(np.zeros(3)))
    true = torso.heading_rad(plant.data.xmat[PELVIS].reshape(3, 3))
    assert heading(begun, plant) == pytest.approx(true)
