import numpy as np
import pytest

from spikeport.networks.operational_space import Gains, OperationalSpaceLaw
from spikeport.robot.arm import TASK_DAMPING

REST = np.array([-0.30, -0.10, 0.0, -0.15])
# Bent elbows: the arm is stretched, hence singular, where the elbow's angle is near 1.6 rad.
POSES = np.array([REST, [-0.5, -0.3, 0.2, 0.1], [0.1, -0.2, -0.4, -0.4], [-0.9, 0.1, 0.3, 0.4]])
DQ = np.array([0.4, -0.7, 1.1, -0.2])
ERROR = np.array([0.05, -0.12, 0.08])


def direct_torque(law, q, dq, error):
    """Return the law as its equation is written, one matrix after the other."""
    arm, gains = law.arm.at(q), law.gains
    J, M, Mx = arm.jacobian, arm.inertia, arm.task_inertia
    projector = np.eye(4) - J.T @ Mx @ J @ np.linalg.inv(M)
    return (
        gains.kp * J.T @ Mx @ error
        - gains.kv * M @ dq
        + arm.gravity
        + projector @ M @ (gains.kn * (np.array(gains.rest_rad) - q))
    )


@pytest.mark.parametrize("q", POSES)
def test_the_torque_equals_the_equation_written_out(law, q):
    assert law.torque(q, DQ, ERROR) == pytest.approx(direct_torque(law, q, DQ, ERROR), abs=1e-9)


def test_gains_scale_their_terms(law):
    strong = OperationalSpaceLaw(law.arm, Gains(kp=200.0, kv=8.0, kn=75.0))
    assert strong.torque(POSES[1], DQ, ERROR) == pytest.approx(
        direct_torque(strong, POSES[1], DQ, ERROR), abs=1e-9
    )
    ours, theirs = law.terms(POSES), strong.terms(POSES)
    assert theirs.kinematic == pytest.approx(2 * ours.kinematic)
    assert theirs.damping == pytest.approx(ours.damping / 2)


def test_a_batch_equals_its_poses_one_by_one(law):
    batch = law.terms(POSES)
    for i, q in enumerate(POSES):
        for many, one in zip(batch, law.terms(q[np.newaxis]), strict=True):
            assert many[i] == pytest.approx(one[0], abs=1e-12)


def test_at_rest_without_error_the_torque_holds_the_arm(law):
    torque = law.torque(REST, np.zeros(4), np.zeros(3))
    assert torque == pytest.approx(law.arm.at(REST).gravity, abs=1e-12)


@pytest.mark.parametrize("q", POSES)
def test_the_posture_term_accelerates_the_hand_by_no_more_than_the_damping(law, q):
    # With J M^-1 J^T = V diag(s) V^T and damping d, J M^-1 N^T = V diag(d^2 / (s^2 + d^2)) V^T
    # times J M^-1: 0 where nothing is damped.
    arm, gains = law.arm.at(q), law.gains
    to_hand = arm.jacobian @ np.linalg.inv(arm.inertia)
    s = np.linalg.svd(to_hand @ arm.jacobian.T, compute_uv=False)
    d = TASK_DAMPING * s[0]
    free = to_hand @ arm.inertia @ (gains.kn * (np.array(gains.rest_rad) - q))
    left = to_hand @ (law.terms(q[np.newaxis]).bias[0] - arm.gravity)
    share = d**2 / (s[-1] ** 2 + d**2)
    assert share < 0.05  # far from a singularity
    assert np.linalg.norm(left) <= share * np.linalg.norm(free) + 1e-12


def test_the_posture_term_pulls_towards_rest(law):
    q = REST + np.array([0.0, 0.4, 0.0, 0.0])
    arm = law.arm.at(q)
    acceleration = np.linalg.solve(arm.inertia, law.terms(q[np.newaxis]).bias[0] - arm.gravity)
    assert acceleration @ (REST - q) > 0.1


def test_the_torque_is_linear_in_error_and_velocity(law):
    q, zero = POSES[1], law.torque(POSES[1], np.zeros(4), np.zeros(3))
    by_error = law.torque(q, np.zeros(4), ERROR) - zero
    by_velocity = law.torque(q, DQ, np.zeros(3)) - zero
    assert law.torque(q, 3 * DQ, -2 * ERROR) - zero == pytest.approx(
        3 * by_velocity - 2 * by_error, abs=1e-9
    )


def test_velocity_is_damped(law):
    q = POSES[1]
    braking = law.torque(q, DQ, np.zeros(3)) - law.torque(q, np.zeros(4), np.zeros(3))
    assert braking == pytest.approx(-law.gains.kv * law.arm.at(q).inertia @ DQ, abs=1e-9)
