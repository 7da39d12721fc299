import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.legs import LEG_JOINTS, POINTS, Legs, support_n
from spikeport.robot.plant import Plant

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def legs():
    return Legs()


@pytest.fixture(params=range(5))
def q(request):
    """Draw joint angles within their ranges."""
    low, high = Plant().model.jnt_range[1:].T
    return np.random.RandomState(request.param).uniform(low, high)


def test_the_legs_joints_come_first():
    assert all("shoulder" not in joint and joint != "torso" for joint in JOINTS[:LEG_JOINTS])
    assert JOINTS[LEG_JOINTS] == "torso"


def test_points_of_the_soles_are_at_the_shapes_of_the_whole_model(legs, q):
    plant = Plant()
    plant.data.qpos[:7] = 0, 0, 0, 1, 0, 0, 0
    plant.data.qpos[7:] = q
    mujoco.mj_kinematics(plant.model, plant.data)
    places = [plant.data.geom(name).xpos for name in POINTS]
    np.testing.assert_allclose(legs.soles(q).points, places, atol=1e-12)
    np.testing.assert_array_equal(legs.radii_m, [plant.model.geom(n).size[0] for n in POINTS])


def test_jacobians_are_derivatives(legs, q):
    soles, step = legs.soles(q), 1e-6
    for joint in range(LEG_JOINTS):
        ahead, behind = q.copy(), q.copy()
        ahead[joint] += step
        behind[joint] -= step
        slope = (legs.soles(ahead).points - legs.soles(behind).points) / (2 * step)
        np.testing.assert_allclose(soles.jacobians[:, :, joint], slope, atol=1e-8)


def test_turning_is_the_angular_velocity_that_heel_and_toe_share(legs, q):
    soles = legs.soles(q)
    dq = np.random.RandomState(0).standard_normal(LEG_JOINTS)
    velocities, turning = soles.jacobians @ dq, soles.turning @ dq
    for heel, toe in ((0, 1), (2, 3)):
        np.testing.assert_array_equal(turning[heel], turning[toe])
        apart = soles.points[toe] - soles.points[heel]
        relative = velocities[toe] - velocities[heel]
        np.testing.assert_allclose(np.cross(turning[heel], apart), relative, atol=1e-12)


def test_supports_are_the_forces_that_the_joint_torques_balance(legs):
    q = Plant().data.qpos[7:]
    soles, torque = legs.soles(q), np.zeros(len(JOINTS))
    for side, force in enumerate((300.0, 40.0)):
        middle = soles.jacobians[2 * side : 2 * side + 2].mean(axis=0)
        torque[:LEG_JOINTS] -= middle.T @ (force * UP)
    np.testing.assert_allclose(support_n(soles, torque, UP), [300.0, 40.0], rtol=0.01)


def test_a_straight_leg_has_a_finite_support(legs):
    straight = legs.soles(np.zeros(len(JOINTS)))
    assert np.isfinite(support_n(straight, np.full(len(JOINTS), 10.0), UP)).all()
