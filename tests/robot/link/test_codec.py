"""Sensors and commands as messages and back, and bytes that must never change."""

import hashlib

import numpy as np
import pytest

from spikeport.robot.link.codec import (
    BASE,
    COMMAND,
    STATE,
    Base,
    Command,
    Turn,
    decode_base,
    decode_command,
    decode_state,
    encode_base,
    encode_command,
    encode_state,
    remote_of,
    turn_of,
)
from spikeport.robot.link.h1 import MODES, SLOTS
from spikeport.robot.link.wire import MessageError
from spikeport.robot.signals import MotorCommands, Sensors

N = 19


def ramp(begin: float) -> np.ndarray:
    return begin + np.arange(N) / 64  # exact in float32


COMMANDS = MotorCommands(*(ramp(begin) for begin in (-1.0, 2.0, 100.0, 3.0, -4.0)))
SENSORS = Sensors(
    0.125,
    np.array([0.5, -0.5, 0.5, 0.5]),
    np.array([0.25, -0.5, 0.125]),
    np.array([0.5, 0.0, 9.75]),
    ramp(-0.5),
    ramp(1.0),
    ramp(-9.0),
)


def test_a_command_is_decoded_as_it_was_encoded() -> None:
    answers, motors = decode_command(encode_command(Command(123_456, COMMANDS)))
    assert answers == 123_456
    for found, sent in zip(motors, COMMANDS, strict=True):
        np.testing.assert_array_equal(found, sent)


def test_a_state_is_decoded_as_it_was_encoded() -> None:
    tick, sensors = decode_state(encode_state(125, SENSORS))
    assert (tick, sensors.time_s) == (125, 0.125)
    for found, sent in zip(sensors[1:], SENSORS[1:], strict=True):
        np.testing.assert_array_equal(found, sent)


def test_the_truth_is_decoded_as_it_was_encoded_with_its_tick_in_ms() -> None:
    sent = Base(61_005, np.array([1.5, -2.25, 0.75]), np.array([0.5, 0.0, -0.125]))
    found = decode_base(encode_base(sent))
    assert found.tick == 61_005
    np.testing.assert_array_equal(found.position, sent.position)
    np.testing.assert_array_equal(found.velocity, sent.velocity)


def test_joints_fill_their_slots_and_the_unused_slot_gets_zeros() -> None:
    message = encode_command(Command(0, COMMANDS))
    for slot in range(20):
        assert message[COMMAND.at(f"motor_cmd[{slot}].mode")] == MODES[slot]
        for name, sent in COMMANDS._asdict().items():
            at = COMMAND.at(f"motor_cmd[{slot}].{name}")
            joint = np.flatnonzero(slot == SLOTS)
            expected = sent[joint[0]] if len(joint) else 0.0
            assert np.frombuffer(message[at : at + 4], "<f4")[0] == expected
    assert message[:3] == bytes((0xFE, 0xEF, 0xFF))


def test_bytes_of_messages_never_change() -> None:
    """Robots rely on these bytes: a changed digest means another protocol."""
    command, state = encode_command(Command(5, COMMANDS)), encode_state(125, SENSORS)
    truth = encode_base(Base(125, SENSORS.gyroscope, SENSORS.accelerometer))
    assert command[-4:].hex() == "54e4dbd7"
    assert state[-4:].hex() == "60f4ed4e"
    digests = [hashlib.sha256(message).hexdigest()[:16] for message in (command, state, truth)]
    assert digests == ["bc34a0b41e8c2e30", "2c705f240fafa1a1", "50acc24d760bde09"]


@pytest.mark.parametrize("part", ["quaternion", "gyroscope", "q", "torque"])
def test_a_state_that_is_not_finite_is_refused(part: str) -> None:
    spoilt = getattr(SENSORS, part).copy()
    spoilt[1] = np.inf
    with pytest.raises(MessageError, match="a number of a sensor is not finite"):
        decode_state(encode_state(1, SENSORS._replace(**{part: spoilt})))


@pytest.mark.parametrize("length", [0.0, 0.4, 2.1])
def test_a_quaternion_far_from_length_1_is_refused(length: float) -> None:
    spoilt = SENSORS._replace(quaternion=length * SENSORS.quaternion)
    with pytest.raises(MessageError, match=f"quaternion is of length {length:g}, not 1"):
        decode_state(encode_state(1, spoilt))


@pytest.mark.parametrize("length", [0.6, 1.9])
def test_a_quaternion_near_length_1_is_scaled_to_it(length: float) -> None:
    _, found = decode_state(
        encode_state(1, SENSORS._replace(quaternion=length * SENSORS.quaternion))
    )
    np.testing.assert_allclose(found.quaternion, SENSORS.quaternion, rtol=1e-6)


@pytest.mark.parametrize("controller", [0, 5, 2**32 - 1, 2**32, 2**63 + 3])
def test_the_fields_of_lock_step_are_read_as_they_were_written(controller: int) -> None:
    turn = Turn(61_005, controller)
    assert turn_of(encode_state(125, SENSORS, turn)) == turn
    assert turn_of(encode_state(125, SENSORS)) == Turn(0, 0)


def test_the_remote_is_all_of_its_bytes_in_a_state() -> None:
    message = bytearray(encode_state(1, SENSORS))
    begin = STATE.at("wireless_remote")
    message[begin : begin + 40] = range(1, 41)
    assert remote_of(bytes(message)) == bytes(range(1, 41))


def test_a_truth_that_is_too_short_or_not_finite_is_refused() -> None:
    with pytest.raises(MessageError, match=r"SportModeState_: 3 bytes, not 512"):
        decode_base(b"123")
    with pytest.raises(MessageError, match="SportModeState_: a number is not finite"):
        decode_base(encode_base(Base(1, np.full(3, np.nan), np.zeros(3))))


def test_layouts_have_unitrees_sizes() -> None:
    assert (COMMAND.size, STATE.size, BASE.size) == (808, 1176, 512)
