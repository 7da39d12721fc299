"""Which robot an option names, and what goes together with it; a stub's end."""

import os
import time
from pathlib import Path

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link import connection
from spikeport.robot.link.client import InlineRobot
from spikeport.robot.link.connection import RobotOptions, connect
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import DAMPING, RobotSettings
from tests.helpers.namespace import in_namespace

HOIST = RobotSettings(hoist=True)


def test_a_place_is_an_interface_and_a_domain() -> None:
    assert RobotOptions("dds:lo:7").place == Place("lo", 7)


@pytest.mark.parametrize("text", ["", "dds", "dds:lo", "dds:lo:x", "dds::1", "stubb", "dds:a:b:1"])
def test_other_texts_are_refused_with_the_form(text: str) -> None:
    with pytest.raises(UsageError, match="write inline, stub or dds:INTERFACE:DOMAIN"):
        connect(RobotOptions(text), HOIST)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (RobotOptions("stub", faults=("loss@3",), real_time=True), "is for lock-step"),
        (RobotOptions("inline", real_time=True), "an inline robot has no clock"),
        (RobotOptions("dds:lo:1", faults=("loss@3",)), "is for inline and stub"),
        (RobotOptions("dds:lo:0"), "would move"),
        (RobotOptions("inline", faults=("cut@3",)), "--robot-fault 'cut@3'"),
    ],
)
def test_what_does_not_go_together_is_refused(options: RobotOptions, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        connect(options, HOIST)


def test_an_inline_robot_has_its_faults() -> None:
    robot = connect(RobotOptions("inline", faults=("nan@1",)), HOIST)
    assert isinstance(robot, InlineRobot)
    robot.exchange(robot.first(), DAMPING)
    assert robot.summary()["robot"]["refused"]["beyond_limits"] == 1


def a_stub() -> dict[str, object]:
    """Use a stub for a while, and return what is left of it."""
    robot = connect(RobotOptions("stub"), HOIST)
    seen = robot.first()
    for _ in range(3):
        seen = robot.exchange(seen, DAMPING)
    process = robot.process_id
    robot.close()
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text()
    return {
        "tick": seen.tick,
        "steps": robot.summary()["robot"]["steps"],
        "alive": Path(f"/proc/{process}").exists(),
        "children": children.split(),
        "sockets": Path("/proc/net/udp").read_text().splitlines()[1:],
    }


def test_a_stub_ends_with_its_controller_and_leaves_nothing() -> None:
    assert in_namespace(a_stub) == {
        "tick": 20,
        "steps": 3,
        "alive": False,
        "children": [],
        "sockets": [],
    }


def a_killed_stub() -> dict[str, object]:
    robot = connect(RobotOptions("stub"), HOIST)
    seen = robot.first()
    os.kill(robot.process_id, 9)
    begin = time.monotonic()
    try:
        for _ in range(3):
            seen = robot.exchange(seen, DAMPING)
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}", "soon": time.monotonic() - begin < 60}
    finally:
        robot.close()
    return {}


@pytest.mark.slow
def test_a_stub_that_was_killed_is_missed() -> None:
    found = in_namespace(a_killed_stub)
    assert found["error"].startswith("RobotLostError: the robot does not answer its state of 5 ms")
    assert "its process ended" in found["error"]
    assert found["soon"]


def test_two_stubs_have_domains_of_their_own() -> None:
    (one, first), (other, second) = connection._free_domain(), connection._free_domain()
    try:
        assert first != second
    finally:
        one.close()
        other.close()
