"""Walks of the exact policy on an estimator's state, and the goals of its errors."""

import estimators
import numpy as np
import pytest
from estimators import CASES, EKF, HEADS, LEGS, TRUTH, Case, Walk, errors, row, walk

from spikeport.experiments.walk.paths import find_path
from spikeport.robot.estimator.simulated_sensors import ROUGH
from spikeport.robot.state import RobotState

GOAL_M_S = np.array([0.15, 0.05, 0.10])
SECONDS = 6.0


def rms(case: Case) -> np.ndarray:
    done = walk(case, 0, SECONDS)
    assert not done.fell
    return np.sqrt(np.mean(errors(done, case.dt_s)["velocity"] ** 2, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        Case(EKF, closed=False),
        Case(EKF, closed=True),
        Case(EKF, closed=True, sensors=ROUGH),
        Case(EKF, closed=True, dt_s=0.002),
    ],
    ids=lambda case: case.name,
)
def test_the_filter_meets_the_goal(case):
    assert (rms(case) < GOAL_M_S).all()


@pytest.mark.slow
def test_the_robot_walks_on_leg_odometry_though_this_misses_the_goal():
    found = rms(Case(LEGS, closed=True))
    assert (found[[0, 2]] > GOAL_M_S[[0, 2]]).all()


@pytest.mark.slow
def test_the_true_state_has_no_error_and_gives_the_same_walk_as_no_estimator():
    one, other = (walk(Case(TRUTH, closed), 0, SECONDS) for closed in (True, False))
    assert not errors(one, 0.005)["velocity"].any()
    np.testing.assert_array_equal(one.true[-1].base_position, other.true[-1].base_position)


@pytest.mark.slow
def test_motion_capture_keeps_the_robot_on_its_path_and_the_estimated_position_near_the_true():
    case = Case(LEGS, closed=True, mocap=True)
    found = errors(walk(case, 0, SECONDS), case.dt_s)
    assert np.linalg.norm(found["place"][-1]) < 0.03
    assert found["track"].max() < 0.05


@pytest.mark.slow
def test_a_row_has_a_cell_for_every_heading():
    assert len(row(Case(EKF, closed=False), 1, 1.5)) == len(HEADS)
    assert len(set(CASES)) == len(CASES)


def test_a_fall_in_the_first_second_leaves_the_last_step(monkeypatch):
    upright, resting = np.array([1.0, 0, 0, 0]), (np.zeros(3), np.zeros(3), *np.zeros((2, 19)))
    true = [RobotState(np.zeros(3), upright, *resting)] * 20
    off = [RobotState(np.array([0.0, 0.0, 0.1 * i]), upright, *resting) for i in range(20)]
    fallen = Walk(find_path("line", 0.5, 10.0), true, off, 1e-4, True)
    found = errors(fallen, 0.005)
    assert {key: len(values) for key, values in found.items()} == {
        **dict.fromkeys(("velocity", "tilt", "yaw", "place"), 1),
        "track": 20,
    }
    np.testing.assert_allclose(found["place"], [[0, 0, 1.9]])
    monkeypatch.setattr(estimators, "walk", lambda *_: fallen)
    cells = row(Case(EKF, closed=False), 2, 40.0)
    assert cells[5] == "1.90"
    assert cells[7] == "2 of 2"
