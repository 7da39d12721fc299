import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.leg_odometry import LegOdometry, OdometryOptions
from spikeport.robot.estimator.legs import LEG_JOINTS, Legs
from spikeport.robot.estimator.simulated_sensors import SimulatedSensors
from spikeport.robot.plant import Plant
from spikeport.robot.signals import Sensors
from spikeport.robot.state import read
from tests.helpers.standing_robot import STANDING

DT_S = 0.005
FAST = OdometryOptions(filter_s=1e-9)


def standing(time_s: float, **values: object) -> Sensors:
    return STANDING._replace(time_s=time_s, **values)


def sliding_back() -> np.ndarray:
    """Return joint velocities (19,) by which both feet go back at about 0.5 m/s without turning."""
    soles, dq = Legs().soles(STANDING.q), np.zeros(len(JOINTS))
    motion = np.concatenate(
        (soles.jacobians[[0, 2]].reshape(6, -1), soles.turning[[0, 2]].reshape(6, -1))
    )
    wanted = np.array([-0.5, 0, 0, -0.5, 0, 0, *6 * (0,)])
    dq[:LEG_JOINTS] = np.linalg.lstsq(motion, wanted, rcond=None)[0]
    return dq


def test_the_estimate_of_a_robot_that_stands_still_does_not_move():
    odometry = LegOdometry()
    first = odometry.reset(standing(0.0))
    for step in range(1, 100):
        found = odometry.update(standing(step * DT_S))
    np.testing.assert_allclose(found.base_linear_velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.base_position, first.base_position, atol=1e-12)
    np.testing.assert_allclose(found.base_quaternion, STANDING.quaternion)
    plant = Plant()
    plant.reset(0, perturbation_rad=0.0)
    assert first.base_position[2] == pytest.approx(plant.data.qpos[2], abs=1e-3)


def test_feet_that_go_back_carry_the_robot_ahead():
    odometry, dq = LegOdometry(FAST), sliding_back()
    odometry.reset(standing(0.0))
    for step in range(1, 41):
        found = odometry.update(standing(step * DT_S, dq=dq))
    np.testing.assert_allclose(found.base_linear_velocity, [0.5, 0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(found.base_position[:2], [0.1, 0.0], atol=1e-3)


def on_a_toe(seed: int) -> Plant:
    """Return a tilted robot whose left toe, its lowest point, stands while all joints move."""
    plant, rng = Plant(), np.random.default_rng(seed)
    qpos, qvel = plant.data.qpos, plant.data.qvel
    qpos[3:7] = np.array([1.0, 0.0, 0.0, 0.0]) + rng.uniform(-0.1, 0.1, 4)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    qpos[7 + JOINTS.index("torso")] = 0.3
    qpos[7 + JOINTS.index("right_knee")] += 0.6
    qpos[7 + JOINTS.index("left_ankle")] += 0.5
    qvel[:] = rng.uniform(-1, 1, len(qvel))
    mujoco.mj_forward(plant.model, plant.data)
    toe, jacobian = plant.model.geom("left_toe"), np.zeros((3, len(qvel)))
    point = plant.data.geom_xpos[toe.id] - (0.0, 0.0, toe.size[0])
    mujoco.mj_jac(plant.model, plant.data, jacobian, None, point, toe.bodyid[0])
    qvel[:3] -= jacobian @ qvel
    mujoco.mj_forward(plant.model, plant.data)
    return plant


@pytest.mark.parametrize("seed", range(3))
def test_the_velocity_of_a_robot_that_turns_on_a_toe_keeps_the_toe_still(seed):
    plant = on_a_toe(seed)
    sensors = SimulatedSensors(plant).read()
    odometry = LegOdometry(FAST)
    odometry.reset(sensors)
    found, true = odometry.update(sensors._replace(time_s=1e-6)), read(plant.data)
    assert np.linalg.norm(true.base_linear_velocity) > 0.1
    np.testing.assert_allclose(found.base_linear_velocity, true.base_linear_velocity, atol=1e-3)
    np.testing.assert_allclose(found.base_angular_velocity, true.base_angular_velocity, atol=1e-9)


def test_the_filter_has_its_time_constant():
    odometry, dq = LegOdometry(OdometryOptions(filter_s=0.05)), sliding_back()
    odometry.reset(standing(0.0))
    for step in range(1, 11):
        found = odometry.update(standing(step * DT_S, dq=dq))
    assert found.base_linear_velocity[0] == pytest.approx(0.5 * (1 - np.exp(-1)), abs=1e-3)


def test_an_observation_that_comes_twice_counts_once():
    odometry, dq = LegOdometry(), sliding_back()
    odometry.reset(standing(0.0))
    once = odometry.update(standing(DT_S, dq=dq))
    twice = odometry.update(standing(DT_S, dq=dq))
    np.testing.assert_array_equal(once.base_position, twice.base_position)
    np.testing.assert_array_equal(once.base_linear_velocity, twice.base_linear_velocity)


def test_a_fix_replaces_place_and_heading():
    odometry, quaternion = LegOdometry(), np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)])
    odometry.reset(standing(0.0, quaternion=quaternion), Fix(np.zeros(3), 0.3))
    fix = Fix(np.array([1.0, 2.0, 3.0]), 0.5)
    found = odometry.update(standing(DT_S, quaternion=quaternion), fix)
    np.testing.assert_array_equal(found.base_position, fix.position)
    assert torso.heading_rad(torso.rotation(found.base_quaternion)) == pytest.approx(0.5)
    later = odometry.update(standing(2 * DT_S, quaternion=quaternion))
    np.testing.assert_allclose(later.base_position, fix.position, atol=1e-9)
    assert torso.heading_rad(torso.rotation(later.base_quaternion)) == pytest.approx(0.5)


def test_odometry_starts_at_a_fix_and_moves_along_its_heading():
    odometry, dq = LegOdometry(FAST), sliding_back()
    fix = Fix(np.array([1.0, 2.0, 3.0]), np.pi / 2)
    odometry.reset(standing(0.0), fix)
    for step in range(1, 41):
        found = odometry.update(standing(step * DT_S, dq=dq))
    np.testing.assert_allclose(found.base_position, [1.0, 2.1, 3.0], atol=2e-3)
