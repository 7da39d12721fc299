"""Sensors and commands of the H1 as messages, and back.

Numbers are float32 on the wire. In lock-step, ``reserve`` is the tick that a command answers, or
that a state wants to be answered, and a state's ``sn`` is the controller that the robot obeys. The
checksum covers these fields; Unitree's own robots and controllers leave them 0.
"""

import math
import struct
from typing import NamedTuple

import numpy as np

from spikeport.robot.link import remote
from spikeport.robot.link.h1 import MODES, SLOTS
from spikeport.robot.link.messages import (
    HEAD,
    LEVEL_FLAG,
    LOW_CMD,
    LOW_STATE,
    N_SLOTS,
    SPORT_MODE_STATE,
)
from spikeport.robot.link.wire import Layout, MessageError
from spikeport.robot.signals import MotorCommands, Sensors

TICK_S = 0.001
"""Length of a state's tick."""
COMMAND, STATE, BASE = Layout(LOW_CMD), Layout(LOW_STATE), Layout(SPORT_MODE_STATE)


class Command(NamedTuple):
    """A command of all joints, and the tick of the state that it answers."""

    answers: int
    motors: MotorCommands


class Turn(NamedTuple):
    """The lock-step fields of a state; all are 0 if the robot runs in real time.

    Attributes
    ----------
    asks : int
        The tick to be answered: the present one, however old the observation is.
    controller : int
        The number of the writer that the robot obeys; 0 for none yet.
    """

    asks: int = 0
    controller: int = 0


class Base(NamedTuple):
    """Motion of the pelvis, as only a simulation knows it or as an odometer measures it.

    Attributes
    ----------
    tick : int
        Time in ms, as in a state.
    position : ndarray, (3,)
        The place of the pelvis in the world, m.
    velocity : ndarray, (3,)
        The velocity of the pelvis in the world, m/s.
    quaternion : ndarray, (4,)
        The orientation of the pelvis, (w, x, y, z); 0 if it is not published.
    """

    tick: int
    position: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray = np.zeros(4)

    @property
    def has_orientation(self) -> bool:
        """True if the orientation is published."""
        return bool(self.quaternion.any())


def _of_joints(layout: Layout, motors: str, name: str) -> np.ndarray:
    return layout.words(*(f"{motors}[{slot}].{name}" for slot in SLOTS))


_COMMANDED = np.concatenate(
    [_of_joints(COMMAND, "motor_cmd", name) for name in MotorCommands._fields]
)
_IMU = [f"imu_state.{name}" for name in ("quaternion", "gyroscope", "accelerometer")]
_SENSED = np.concatenate(
    [
        STATE.words(*_IMU),
        *(_of_joints(STATE, "motor_state", name) for name in ("q", "dq", "tau_est")),
    ]
)
_ENDS = (4, 7, 10, 29, 48, 67)
"""Ends of the parts of an observation: quaternion, rates, forces, angles, velocities, torques."""
_PARTS = list(map(slice, (0, *_ENDS), _ENDS))
# Lock-step uses fields that are 0 in real time.
_ANSWERS, _TICK = int(COMMAND.words("reserve")[0]), int(STATE.words("tick")[0])
_ASKS, _CONTROLLER = int(STATE.words("reserve")[0]), STATE.words("sn")
_ASKED, _OBEYED = struct.Struct("<I"), struct.Struct("<Q")
_STAMP = BASE.words("stamp.sec", "stamp.nanosec")
_BASE = BASE.words("position", "velocity", "imu_state.quaternion")


def _blank(layout: Layout, modes: dict[str, int]) -> np.ndarray:
    """Return the words of a message with only the fields that are always the same."""
    message = np.zeros(layout.size, np.uint8)
    message[layout.at("head") : layout.at("head") + 2] = HEAD
    message[layout.at("level_flag")] = LEVEL_FLAG
    for path, mode in modes.items():
        message[layout.at(path)] = mode
    return message.view("<u4")


_BLANK_STATE = _blank(STATE, {})
_BLANK_COMMAND = _blank(
    COMMAND, {f"motor_cmd[{slot}].mode": MODES[slot] for slot in range(N_SLOTS)}
)


def encode_command(command: Command) -> bytes:
    """Return the message of a command; slots without a motor are commanded nothing."""
    words = _BLANK_COMMAND.copy()
    words[_ANSWERS] = command.answers
    return COMMAND.sealed(words, _COMMANDED, np.concatenate(command.motors))


def decode_command(message: bytes) -> Command:
    """Return the command of a message; raises MessageError for a wrong size or checksum."""
    words, numbers = COMMAND.opened(message, _COMMANDED)
    return Command(int(words[_ANSWERS]), MotorCommands(*numbers.reshape(5, -1)))


def encode_state(tick: int, sensors: Sensors, turn: Turn | None = None) -> bytes:
    """Return the message of an observation; the tick, in ms, says when it was made."""
    words = _BLANK_STATE.copy()
    words[_TICK] = tick
    if turn is not None:
        words[_ASKS] = turn.asks
        words[_CONTROLLER] = turn.controller % 2**32, turn.controller >> 32
    return STATE.sealed(words, _SENSED, np.concatenate(sensors[1:]))


def decode_state(message: bytes) -> tuple[int, Sensors]:
    """Return tick and observation of a message.

    Raises
    ------
    MessageError
        If its size or checksum is wrong, a number is not finite, or the quaternion's length is
        far from 1.
    """
    words, numbers = STATE.opened(message, _SENSED)
    if not math.isfinite(numbers.dot(numbers)):  # squares of float32 stay far within float64
        raise MessageError("LowState_: a number of a sensor is not finite")
    parts = [numbers[part] for part in _PARTS]
    length = math.sqrt(parts[0].dot(parts[0]))
    if not 0.5 < length < 2:
        raise MessageError(f"LowState_: the IMU's quaternion is of length {length:g}, not 1")
    parts[0] /= length
    tick = int(words[_TICK])
    return tick, Sensors(tick * TICK_S, *parts)


def turn_of(message: bytes) -> Turn:
    """Return the lock-step fields of a state's message of the right size."""
    (asks,) = _ASKED.unpack_from(message, STATE.at("reserve"))
    (controller,) = _OBEYED.unpack_from(message, STATE.at("sn"))
    return Turn(asks, controller)


def remote_of(message: bytes) -> bytes:
    """Return the bytes of the wireless remote in a state's message of the right size."""
    begin = STATE.at("wireless_remote")
    return message[begin : begin + remote.SIZE]


def encode_base(base: Base) -> bytes:
    """Return the message of the pelvis' motion."""
    words = np.zeros(BASE.size, np.uint8).view("<u4")
    # Ticks are ms, a stamp is seconds and ns.
    words[_STAMP] = base.tick // 1000, base.tick % 1000 * 1_000_000
    words.view("<f4")[_BASE] = np.concatenate(base[1:])
    return words.tobytes()


def decode_base(message: bytes) -> Base:
    """Return the pelvis' motion in a message; raises MessageError for an implausible one."""
    BASE.check_size(message)
    words = np.frombuffer(message, "<u4")
    seconds, nanoseconds = words[_STAMP].tolist()
    numbers = words.view("<f4")[_BASE].astype(float)
    if not np.isfinite(numbers).all():
        raise MessageError("SportModeState_: a number is not finite")
    place, velocity, quaternion = np.split(numbers, (3, 6))
    length = float(np.linalg.norm(quaternion))
    if length and not 0.5 <= length <= 2:
        raise MessageError(f"SportModeState_: a quaternion of length {length:.4g}, not 1 or 0")
    return Base(1000 * seconds + nanoseconds // 1_000_000, place, velocity, quaternion)
