"""A robot in this process: the same messages, and the same reasons to give it up."""

import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.link.client import InlineRobot
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings


def inline(*faults: str) -> InlineRobot:
    plan = [FAULTS.parse(text) for text in faults]
    return InlineRobot(LockStep(SimulatedRobot(RobotSettings(hoist=True)), plan))


def test_an_observation_answers_each_command() -> None:
    robot = inline()
    seen = robot.first()
    for tick in (10, 15, 20):
        seen = robot.exchange(seen, DAMPING)
        assert seen.tick == tick
        assert seen.truth is not None
        assert seen.truth.tick == tick
    assert robot.summary()["states"] == 3
    assert robot.summary()["robot"]["steps"] == 3


def test_a_robot_that_is_silent_is_given_up() -> None:
    robot = inline("stop@2")
    seen = robot.exchange(robot.first(), DAMPING)
    with pytest.raises(RobotLostError, match="sent no state after that of 10 ms"):
        robot.exchange(seen, DAMPING)


def test_a_fault_that_was_never_reached_is_named(recwarn: pytest.WarningsRecorder) -> None:
    robot = inline("duplicate@3", "loss@4")
    ticks(robot, 3)
    robot.close()
    assert [str(one.message) for one in recwarn] == [
        "fault loss@4 was never reached: the robot's run has 3 steps"
    ]


def ticks(robot: InlineRobot, steps: int) -> list[tuple[int, int]]:
    """Return the ticks that are observed step by step, and those that ask for an answer."""
    seen, found = robot.first(), []
    for _ in range(steps):
        seen = robot.exchange(seen, DAMPING)
        found.append((seen.tick, seen.asks))
    return found


def test_a_state_that_is_late_is_held_and_answered_at_its_time() -> None:
    robot = inline("state-delay=10:1")
    assert ticks(robot, 5) == [(5, 10), (5, 15), (10, 20), (15, 25), (20, 30)]
    assert (robot.figures.states, robot.figures.held) == (3, 2)
    assert robot.summary()["robot"]["steps"] == 5


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("state-loss@3", [10, 10, 20, 25]),
        ("state-duplicate@3", [10, 15, 20, 25]),
        ("state-reorder@3", [10, 10, 20, 25]),
    ],
)
def test_states_may_be_lost_or_come_twice_or_in_another_order(
    fault: str, expected: list[int]
) -> None:
    """The newest that came is controlled by, and an older one that comes later is not."""
    assert [tick for tick, _ in ticks(inline(fault), 4)] == expected


def test_a_robot_without_new_states_for_too_long_is_damped() -> None:
    robot = inline("state-mute@3")
    with pytest.raises(
        RobotLostError, match="go into damping: no new state for 45 ms, allowed 40 ms"
    ):
        ticks(robot, 100)
    assert robot.summary()["robot"]["steps"] == 11


def test_a_state_that_is_not_finite_damps_the_robot() -> None:
    robot = inline("state-nan@3")
    with pytest.raises(RobotLostError, match="go into damping: LowState_: a number of a sensor"):
        ticks(robot, 100)
    summary = robot.summary()
    assert (summary["damaged"], summary["robot"]["steps"]) == (1, 3)


def test_ticks_do_not_go_back() -> None:
    robot = inline()
    seen = robot.first()
    with pytest.raises(RobotLostError, match="its tick went from 70 back to 5 ms; start the run"):
        robot.exchange(seen._replace(asks=70), DAMPING)
