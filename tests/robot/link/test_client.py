"""The robot in this process: the messages of a remote one, and the same reasons to give it up."""

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


def test_each_command_is_answered_by_the_next_observation() -> None:
    robot = inline()
    seen = robot.first()
    for tick in (10, 15, 20):
        seen = robot.exchange(seen, DAMPING)
        assert seen.tick == tick
        assert seen.truth is not None
        assert seen.truth.tick == tick
    assert robot.summary()["states"] == 3
    assert robot.summary()["robot"]["steps"] == 3


def test_a_silent_robot_is_given_up() -> None:
    robot = inline("stop@2")
    seen = robot.exchange(robot.first(), DAMPING)
    with pytest.raises(RobotLostError, match="sent no state after that of 10 ms"):
        robot.exchange(seen, DAMPING)


def test_closing_warns_of_a_fault_that_was_never_reached(recwarn: pytest.WarningsRecorder) -> None:
    robot = inline("duplicate@3", "loss@4")
    ticks(robot, 3)
    robot.close()
    assert [str(one.message) for one in recwarn] == [
        "fault loss@4 was never reached: the robot's run has 3 steps"
    ]


def ticks(robot: InlineRobot, steps: int) -> list[tuple[int, int]]:
    """Return the observed tick of each step, and the tick that asks for an answer."""
    seen, found = robot.first(), []
    for _ in range(steps):
        seen = robot.exchange(seen, DAMPING)
        found.append((seen.tick, seen.asks))
    return found


def test_the_last_observation_is_held_while_a_state_is_late() -> None:
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
def test_lost_duplicated_and_reordered_states_are_tolerated(
    fault: str, expected: list[int]
) -> None:
    """The observation is the newest state; an older one that arrives later is ignored."""
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


def test_a_robot_whose_tick_goes_back_is_given_up() -> None:
    robot = inline()
    seen = robot.first()
    with pytest.raises(RobotLostError, match="its tick went from 70 back to 5 ms; start the run"):
        robot.exchange(seen._replace(asks=70), DAMPING)
