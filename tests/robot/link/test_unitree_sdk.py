"""Unitree's C++ SDK (Cyclone 0.10.2) at the other end of the interface, in both roles.

far-unitree-sdk is BSD-3-Clause and not a dependency. `make referees` installs it apart from
spikeport; UNITREE_PYTHON names the Python of another place that has it. It speaks in domain 0.
"""

import base64
import json
import os
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

from spikeport.robot.link.codec import Command, decode_command, decode_state, encode_command
from spikeport.robot.link.h1 import SLOTS
from spikeport.robot.link.sport_mode import EMPTY, RELEASE_MODE
from spikeport.robot.signals import MotorCommands
from tests.helpers import unitree_messages
from tests.helpers.namespace import in_namespace

INSTALLED = Path(__file__).parents[3] / ".referees" / "unitree" / "bin" / "python"
PYTHON = os.environ.get("UNITREE_PYTHON", INSTALLED)
PEER = Path(unitree_messages.__file__).with_name("unitree_peer.py")
RAMP = SLOTS / 64
SECONDS = 4.0

needs_the_sdk = pytest.mark.skipif(
    not Path(PYTHON).is_file(), reason="far-unitree-sdk is absent: make referees"
)


def started(role: str) -> subprocess.Popen[str]:
    command = [str(PYTHON), str(PEER), role, str(SECONDS)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def last_line(process: subprocess.Popen[str]) -> dict[str, object]:
    line = process.communicate(timeout=60)[0].splitlines()[-1]
    return json.loads(line.removeprefix("robot: "))


def message(packed: str) -> bytes:
    return zlib.decompress(base64.b85decode(packed))


def test_a_command_of_unitrees_sdk_is_decoded_with_its_checksum() -> None:
    command = decode_command(message(unitree_messages.LOW_CMD))
    assert command.answers == 0
    np.testing.assert_array_equal(command.motors.q, (SLOTS / 100).astype("f4"))
    for name, value in (("dq", 0.0), ("kp", 100.0), ("kd", 5.0), ("tau", 0.5)):
        np.testing.assert_array_equal(getattr(command.motors, name), np.full(19, value))


def test_a_state_of_unitrees_sdk_is_decoded_with_its_checksum() -> None:
    _, sensors = decode_state(message(unitree_messages.LOW_STATE))
    np.testing.assert_array_equal(sensors.q, (SLOTS / 100).astype("f4"))
    np.testing.assert_array_equal(sensors.quaternion, [1, 0, 0, 0])
    np.testing.assert_array_equal(sensors.accelerometer, np.array([0, 0, 9.81]).astype("f4"))


def our_robot() -> dict[str, object]:
    where = ["--domain", "0", "--may-move-a-real-robot"]
    serve = ["robot", "serve", *where, "--hoist", "--once", "--idle", "60"]
    with subprocess.Popen(
        [sys.executable, "-m", "spikeport", *serve], stdout=subprocess.PIPE, text=True
    ) as robot:
        assert robot.stdout is not None
        robot.stdout.readline()  # ready: the peer speaks for `SECONDS`, even if nobody listens
        return {"peer": last_line(started("controller")), "robot": last_line(robot)}


@needs_the_sdk
@pytest.mark.slow
def test_unitrees_controller_drives_our_robot() -> None:
    found = in_namespace(our_robot)
    robot = found["robot"]
    assert robot["steps"] > 0
    assert not any(robot["refused"].values())
    reached = np.array(found["peer"]["q"])[SLOTS]
    assert np.abs(reached - RAMP).max() < 0.2
    assert np.linalg.norm(found["peer"]["quaternion"]) == pytest.approx(1)


def our_controller() -> dict[str, object]:
    from spikeport.robot.link.bus import Bus
    from spikeport.robot.link.messages import COMMANDS, STATES
    from spikeport.robot.link.motion_switcher import MotionSwitcher
    from spikeport.robot.link.place import Place

    peer, states = started("robot"), []
    ramp, none = np.arange(19) / 64, np.zeros(19)
    motors = MotorCommands(ramp, none, ramp + 100, ramp + 1, ramp - 1)
    with Bus(Place(domain=0), reliable=False) as bus:
        reader, writer = bus.reader(STATES), bus.writer(COMMANDS)
        switcher = MotionSwitcher(bus, required=True)
        modes, released = switcher.release(), switcher.ask(RELEASE_MODE, EMPTY)._asdict()
        until = time.monotonic() + 60
        while peer.poll() is None and time.monotonic() < until:
            for arrival in reader.take(0.05):
                states.append(decode_state(arrival.message)[1].q.tolist())
                writer.write(encode_command(Command(0, motors)))
    return {
        "peer": last_line(peer),
        "states": states[-1:],
        "sent": [m.tolist() for m in motors],
        "modes": modes,
        "released": released,
    }


@needs_the_sdk
@pytest.mark.slow
def test_our_controller_drives_unitrees_robot() -> None:
    found = in_namespace(our_controller)
    np.testing.assert_array_equal(found["states"], [RAMP])
    assert found["modes"] == []
    assert found["released"]["code"] == 0
    for name, sent in zip(MotorCommands._fields, found["sent"], strict=True):
        np.testing.assert_array_equal(np.array(found["peer"][name])[SLOTS], sent)
