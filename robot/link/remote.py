"""The wireless remote: 40 bytes of the robot's state, and keys of a terminal that mean the same.

Bytes 2 and 3 are the keys, one bit each; the sticks are little-endian float32 at bytes 4 (left x),
8 (right x), 12 (right y) and 20 (left y). Source: unitree_rl_gym,
``deploy/deploy_real/common/remote_controller.py``.
"""

import struct
from typing import NamedTuple

from spikeport.errors import UsageError
from spikeport.robot.link.controller_states import Event

SIZE = 40
"""Bytes of a remote's message."""

_LAYOUT = struct.Struct("<2xH3f4xf16x")
KEYS = (
    *("R1", "L1", "start", "select", "R2", "L2", "F1", "F2"),
    *("A", "B", "X", "Y", "up", "right", "down", "left"),
)
"""The keys, from the lowest bit."""

PRESSES: dict[frozenset[str], Event] = {
    frozenset({"start"}): Event.START,
    frozenset({"A"}): Event.RUN,
    frozenset({"L1", "R1"}): Event.REARM,
    frozenset({"select"}): Event.STOP,
}
"""Events of keys that are pressed together; the last one wins. Start, A and select are those of
Unitree's own controllers."""

TERMINAL = {"s": Event.START, "a": Event.RUN, " ": Event.STOP, "r": Event.REARM}
"""The event of each key of the terminal."""


class Remote(NamedTuple):
    """Keys that are down, and sticks from -1 to 1."""

    keys: frozenset[str]
    left_x: float
    left_y: float
    right_x: float
    right_y: float


def decode(message: bytes) -> Remote:
    """Return the keys and sticks of a message; raises UsageError for one of another size.

    A stick that is no number is taken to be in its middle.
    """
    if len(message) != SIZE:
        raise UsageError(f"wireless_remote has {len(message)} bytes, {SIZE} are needed")
    bits, left_x, right_x, right_y, left_y = _LAYOUT.unpack(message)
    keys = frozenset(key for bit, key in enumerate(KEYS) if bits >> bit & 1)
    return Remote(keys, *(_stick(value) for value in (left_x, left_y, right_x, right_y)))


def _stick(value: float) -> float:
    # A NaN is not equal to itself.
    return min(max(value, -1.0), 1.0) if value == value else 0.0


def pressed(before: Remote, now: Remote) -> list[Event]:
    """Return the events of keys that went down, and of the stop key as long as it is down."""
    return [
        event
        for keys, event in PRESSES.items()
        if keys <= now.keys and (event is Event.STOP or not keys <= before.keys)
    ]
