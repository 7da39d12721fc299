import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator import torso
from spikeport.robot.estimator.legs import WAIST
from spikeport.robot.estimator.simulated_sensors import SimulatedSensors
from spikeport.robot.plant import Plant


@pytest.fixture
def plant():
    """Return a robot in flight that turns and twists its waist."""
    plant = Plant()
    rng = np.random.RandomState(3)
    plant.data.qpos[:3] = 1.0, 2.0, 3.0
    plant.data.qpos[3:7] = rng.standard_normal(4)
    plant.data.qpos[3:7] /= np.linalg.norm(plant.data.qpos[3:7])
    plant.data.qpos[7 + WAIST] = 0.7
    plant.data.qvel[:] = rng.standard_normal(plant.model.nv)
    mujoco.mj_forward(plant.model, plant.data)
    return plant


def test_orientation_and_rate_of_the_pelvis_are_the_torsos_less_the_waists(plant):
    sensors, true = SimulatedSensors(plant).read(), plant.state
    found = torso.pelvis_angular_velocity(sensors.gyroscope, sensors.q[WAIST], sensors.dq[WAIST])
    np.testing.assert_allclose(found, true.base_angular_velocity, atol=1e-12)
    pelvis = torso.pelvis_rotation(torso.rotation(sensors.quaternion), sensors.q[WAIST])
    np.testing.assert_allclose(pelvis, torso.rotation(true.base_quaternion), atol=1e-12)
    quaternion = torso.pelvis_quaternion(sensors.quaternion, sensors.q[WAIST])
    assert abs(quaternion @ true.base_quaternion) == pytest.approx(1, abs=1e-12)


def test_the_waist_is_the_joint_between_torso_and_pelvis(plant):
    assert JOINTS[WAIST] == "torso"
    joint = plant.model.joint("torso")
    np.testing.assert_array_equal(joint.axis, [0, 0, 1])
    np.testing.assert_array_equal(plant.data.body("torso_link").xpos, plant.data.qpos[:3])


def test_quaternions_and_rotations_convert_into_each_other():
    rng = np.random.RandomState(0)
    for quaternion in rng.standard_normal((20, 4)):
        rotation = torso.rotation(quaternion)
        np.testing.assert_allclose(torso.rotation(torso.quaternion(rotation)), rotation, atol=1e-12)
        np.testing.assert_allclose(torso.rotation(3 * quaternion), rotation, atol=1e-12)


def test_turning_a_body_changes_its_heading_by_the_same_angle():
    rotation = torso.rotation(np.array([0.9, 0.1, -0.2, 0.3]))
    before = torso.heading_rad(rotation)
    assert torso.heading_rad(torso.turned(rotation, 0.4)) == pytest.approx(before + 0.4)
