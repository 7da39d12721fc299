import numpy as np
import pytest

from spikeport.robot.description import ARM_JOINTS, JOINTS
from spikeport.robot.walk_interface import CONTROL_DT_S, POSE_RAD
from spikeport.training.busy_arms import HIGHEST_RAD, LOWEST_RAD, SPEED_RAD_S, BusyArms

RIGHT = [JOINTS.index(joint) for joint in ARM_JOINTS]
LEFT = [JOINTS.index(joint.replace("right", "left")) for joint in ARM_JOINTS]
N = 400
ALL = np.ones(N, bool)
STEP_RAD = SPEED_RAD_S * CONTROL_DT_S
ASKED = np.tile(POSE_RAD + 0.01, (N, 1))


def busy(share=1.0):
    arms = BusyArms(N, share, np.random.default_rng(0))
    arms.restart(ALL)
    return arms


def after(arms, seconds, standing=ALL):
    for _ in range(round(seconds / CONTROL_DT_S)):
        targets = arms.override(ASKED, standing)
    return targets


def test_one_arm_wanders_within_its_poses():
    targets = after(busy(), 8.0) - POSE_RAD
    right, left = (np.abs(targets[:, side] - 0.01).max(axis=1) > 1e-9 for side in (RIGHT, LEFT))
    assert (right ^ left).mean() > 0.95
    assert right.mean() == pytest.approx(0.5, abs=0.1)
    assert (targets[right][:, RIGHT] >= LOWEST_RAD - 1e-9).all()
    assert (targets[right][:, RIGHT] <= HIGHEST_RAD + 1e-9).all()
    others = np.setdiff1d(np.arange(len(JOINTS)), RIGHT + LEFT)
    assert targets[:, others] == pytest.approx(0.01)


def test_a_busy_arm_moves_no_faster_than_its_limit():
    arms, asked = busy(), np.tile(POSE_RAD, (N, 1))
    targets = [arms.override(asked, ALL if step < 100 else ~ALL) for step in range(200)]
    change = np.abs(np.diff(targets, axis=0))
    assert change.max() == pytest.approx(STEP_RAD)


def test_a_busy_arm_returns_before_it_obeys_the_policy_that_is_to_walk():
    arms = busy()
    targets = [after(arms, 8.0)]
    assert np.abs(targets[0] - POSE_RAD).max() > 0.5
    targets += [arms.override(ASKED, ~ALL) for _ in range(round(1.5 / CONTROL_DT_S))]
    obeys = np.array(targets) == ASKED
    assert obeys[-1].all()
    obeyed = obeys[1:] & ~obeys[:-1]
    assert obeyed.any(axis=(0, 2)).mean() > 0.9
    away = np.abs(np.array(targets) - POSE_RAD)
    assert away[:-1][obeyed].max() <= STEP_RAD + 1e-9


def test_the_policys_targets_are_obeyed_if_no_arm_is_busy():
    assert after(busy(share=0.0), 2.0) is ASKED
