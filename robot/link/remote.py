"""The wireless remote: 40 bytes of the robot's state, and terminal keys with the same meaning.

Bytes 2 and 3 are the keys, one bit each; the sticks are not read. Source: unitree_rl_gym,
``deploy/deploy_real/common/remote_controller.py``.
"""

from spikeport.errors import UsageError
from spikeport.robot.link.controller_states import Event

SIZE = 40
"""Bytes of the remote's message."""

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
"""Events of keys that are pressed together; the last one wins. Start, A and select are the keys of
Unitree's own controllers."""

TERMINAL = {"s": Event.START, "a": Event.RUN, " ": Event.STOP, "r": Event.REARM}
"""The event of each key of the terminal."""


def decode(message: bytes) -> frozenset[str]:
    """Return the keys that are down in a message; raises UsageError for a wrong size."""
    if len(message) != SIZE:
        raise UsageError(f"wireless_remote has {len(message)} bytes, {SIZE} are needed")
    bits = int.from_bytes(message[2:4], "little")
    return frozenset(key for bit, key in enumerate(KEYS) if bits >> bit & 1)


def pressed(before: frozenset[str], now: frozenset[str]) -> list[Event]:
    """Return the events of keys that went down, and of the stop key as long as it is down."""
    return [
        event
        for keys, event in PRESSES.items()
        if keys <= now and (event is Event.STOP or not keys <= before)
    ]
