"""A first look at a robot: a report of its states and problems, without sending anything."""

import subprocess
import sys

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.description import JOINTS
from spikeport.robot.link.codec import encode_state
from spikeport.robot.link.h1 import SLOTS
from spikeport.robot.link.listener import Heard
from tests.helpers.fake_bus import Arrival
from tests.helpers.namespace import in_namespace
from tests.helpers.standing_robot import STANDING


def heard(*messages: bytes, writers: tuple[int, ...] = (1,)) -> Heard:
    found = Heard()
    for i, message in enumerate(messages):
        found.take(Arrival(message, writers[i % len(writers)]))
    return found


def state(tick: int, **values: object) -> bytes:
    return encode_state(tick, STANDING._replace(**values))


def test_a_standing_robot_has_no_problems_and_is_reported_joint_by_joint() -> None:
    found = heard(*(state(tick) for tick in (2, 4, 6, 10)))
    assert found.problems() == []
    lines = found.lines()
    assert lines[0] == "4 states; ticks from 2 to 10 ms, 2 ms apart"
    assert lines[1].startswith(
        "IMU of the torso: tilted by 0.0 degrees, turns by 0.00 rad/s, feels 9.8"
    )
    assert len(lines) == 3 + len(JOINTS)
    assert lines[3].split() == ["0", "right_hip_roll", "0.000", "0.000", "0.00"]
    by_slot = [JOINTS[i] for i in np.argsort(SLOTS)]
    assert [line.split()[1] for line in lines[3:]] == by_slot


def test_a_tick_that_does_not_advance_and_a_tilt_are_reported() -> None:
    lying = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0])
    lines = heard(state(2), state(2, quaternion=lying)).lines()
    assert "their tick does not advance" in lines[0]
    assert "tilted by 90.0 degrees" in lines[1]


def test_without_a_readable_state_no_tick_is_reported() -> None:
    """Unitree's simulator in Python sets no checksum."""
    assert heard(bytes(1176)).lines() == ["0 states; no message could be read"]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (heard(state(2), bytes(1176)), "1 states would be refused, the last: LowState_: its check"),
        (heard(state(2, q=np.full(19, 4.0))), "the last: q of left_hip_yaw is 4 rad"),
        (heard(state(2), state(4), writers=(1, 2)), "2 processes publish states"),
    ],
)
def test_problems_that_would_stop_a_controller_are_reported(found: Heard, words: str) -> None:
    (problem,) = found.problems()
    assert words in problem


def listened() -> dict[str, object]:
    """Listen to a robot that waits for commands, and then where no robot is."""
    from spikeport.robot.link.listener import listen
    from spikeport.robot.link.place import Place

    serve = [sys.executable, "-m", "spikeport", "robot", "serve", "--hoist", "--idle", "60"]
    lines: list[str] = []
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as robot:
        assert robot.stdout is not None
        robot.stdout.readline()
        listen(Place(), 3.0, lines.append)
        robot.terminate()
        words = robot.communicate()[0]
    try:
        listen(Place(domain=7), 0.2, lines.append)
    except RobotLostError as error:
        return {"lines": lines, "robot": words, "nobody": str(error)}
    return {}


@pytest.mark.slow
def test_listening_sends_nothing_to_the_robot() -> None:
    found = in_namespace(listened)
    assert "their tick does not advance" in found["lines"][0]
    assert '"steps": 0' in found["robot"]
    assert found["nobody"] == (
        "nobody published rt/lowstate for 0.2 s on interface lo, domain 7; is a robot on, or "
        "`spikeport robot serve` running, there?"
    )


def test_ticks_of_refused_states_are_reported_too() -> None:
    lines = heard(*(state(tick, q=np.full(19, 4.0)) for tick in (2, 4, 6))).lines()
    assert lines[0] == "0 states; ticks from 2 to 6 ms, 2 ms apart"
