"""A robot in this process: the same messages, and the same reasons to give it up."""

import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.link.client import InlineRobot, check_order, observed
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.robot import DAMPING, SimulatedRobot
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
    with pytest.raises(RobotLostError, match="does not answer its state of 10 ms"):
        robot.exchange(seen, DAMPING)


def test_ticks_do_not_go_back() -> None:
    robot = LockStep(SimulatedRobot(RobotSettings(hoist=True)))
    found = observed(robot.published())
    check_order(found, found)
    with pytest.raises(RobotLostError, match="its tick went from 7 back to 5 ms"):
        check_order(found._replace(tick=7), found)
