"""Options that choose a robot, and their combinations."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.client import InlineRobot
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import RobotSettings

HOIST = RobotSettings(hoist=True)


def test_a_place_is_an_interface_and_a_domain() -> None:
    assert RobotOptions("dds:lo:7").place == Place("lo", 7)


@pytest.mark.parametrize("text", ["", "dds", "dds:lo", "dds:lo:x", "dds::1", "stubb", "dds:a:b:1"])
def test_a_malformed_robot_option_is_refused_with_the_expected_form(text: str) -> None:
    with pytest.raises(UsageError, match="write inline, stub or dds:INTERFACE:DOMAIN"):
        connect(RobotOptions(text), HOIST)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (RobotOptions("stub", faults=("loss@3",), real_time=True), "is for lock-step"),
        (RobotOptions("inline", real_time=True), "an inline robot has no clock"),
        (RobotOptions("dds:lo:1", faults=("loss@3",)), "is for --robot inline and stub"),
        (RobotOptions("dds:lo:0"), "would move"),
        (RobotOptions("inline", faults=("cut@3",)), "--robot-fault 'cut@3'"),
        (RobotOptions("stub", states=True, real_time=True), "--robot-states is for"),
        (RobotOptions("dds:lo:1", states=True), "--robot-states is for"),
    ],
)
def test_invalid_combinations_of_options_are_refused(options: RobotOptions, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        connect(options, HOIST)


def test_an_inline_robot_gets_the_faults_of_its_options() -> None:
    robot = connect(RobotOptions("inline", faults=("nan@1",)), HOIST)
    assert isinstance(robot, InlineRobot)
    robot.exchange(robot.first(), DAMPING)
    assert robot.summary()["robot"]["refused"]["beyond_limits"] == 1
