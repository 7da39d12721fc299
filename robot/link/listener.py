"""``spikeport robot listen``: a first look at a robot, to which nothing is sent."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from spikeport.errors import RobotLostError
from spikeport.robot.description import JOINTS
from spikeport.robot.estimator.torso import rotation
from spikeport.robot.link.admission import beyond, h1_limits
from spikeport.robot.link.codec import decode_state
from spikeport.robot.link.h1 import SLOTS
from spikeport.robot.link.messages import STATES
from spikeport.robot.link.place import Place
from spikeport.robot.link.wire import MessageError
from spikeport.robot.signals import Sensors

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Arrival

SLICE_S = 0.2


class Heard:
    """The states that came from a robot.

    Attributes
    ----------
    states, refused : int
        The numbers of states that a controller would trust, and would refuse.
    reason : str
        The reason of the last refusal.
    writers : set of int
        The numbers of the states' writers.
    sensors : Sensors or None
        The last observation.
    """

    def __init__(self) -> None:
        self.states = self.refused = self._read = 0
        self.reason = ""
        self.writers: set[int] = set()
        self.sensors: Sensors | None = None
        self._ticks: set[int] = set()
        self._limits = h1_limits()

    def take(self, arrival: "Arrival") -> None:
        """Count a message."""
        self.writers.add(arrival.writer)
        try:
            tick, self.sensors = decode_state(arrival.message)
        except MessageError as error:
            self._refuse(str(error))
            return
        self._read += 1
        self._ticks.add(tick)
        reason = beyond(self.sensors, self._limits)
        if reason is None:
            self.states += 1
        else:
            self._refuse(reason)

    def _refuse(self, reason: str) -> None:
        self.refused += 1
        self.reason = reason

    def problems(self) -> list[str]:
        """Return the reasons why a controller would not trust the robot."""
        found = []
        if self.refused:
            found.append(f"{self.refused:,} states would be refused, the last: {self.reason}")
        if len(self.writers) > 1:
            found.append(f"{len(self.writers)} processes publish states; only one may")
        return found

    def lines(self) -> list[str]:
        """Return a report: states and their ticks, the IMU, and a line for each joint."""
        lines = [f"{self.states:,} states; {_moments(self._read, sorted(self._ticks))}"]
        if self.sensors is None:
            return lines
        _, quaternion, gyroscope, accelerometer, *joints = self.sensors
        turns, feels = np.linalg.norm(gyroscope), np.linalg.norm(accelerometer)
        # The last entry is the cosine of the angle between the IMU's z axis and the vertical.
        tilt = math.degrees(math.acos(min(max(rotation(quaternion)[2, 2], -1.0), 1.0)))
        lines.append(
            f"IMU of the torso: tilted by {tilt:.1f} degrees, turns by {turns:.2f} rad/s, feels "
            f"{feels:.2f} m/s^2"
        )
        lines.append(f"{'slot':>4}  {'joint':21}{'rad':>8}{'rad/s':>8}{'N m':>8}")
        for slot, joint, q, dq, torque in sorted(zip(SLOTS, JOINTS, *joints, strict=True)):
            lines.append(f"{slot:4}  {joint:21}{q:8.3f}{dq:8.3f}{torque:8.2f}")
        return lines


def _moments(messages: int, ticks: list[int]) -> str:
    if not ticks:
        return "no message could be read"
    if messages < 2:
        return f"the tick of one message, {ticks[0]:,} ms, shows no rate"
    if len(ticks) < 2:
        return "their tick does not advance, like that of a simulation before its first command"
    # The median, as some states may have been missed.
    apart_ms = np.median(np.diff(ticks))
    return f"ticks from {ticks[0]:,} to {ticks[-1]:,} ms, {apart_ms:g} ms apart"


def listen(place: Place, seconds: float, say: Callable[[str], None]) -> None:
    """Listen to the states of a robot for a time, and print a report.

    Raises
    ------
    MissingExtraError, BackendError
        If DDS cannot begin there.
    RobotLostError
        If no state came, or a controller would not trust the robot.
    """
    from spikeport.robot.link.bus import Bus  # needs cyclonedds

    heard = Heard()
    with Bus(place, reliable=False) as bus:
        states, until = bus.reader(STATES), time.monotonic() + seconds
        while (left_s := until - time.monotonic()) > 0:
            for arrival in states.take(min(left_s, SLICE_S)):
                heard.take(arrival)
    if not heard.writers:
        raise RobotLostError(
            f"nobody published {STATES.name} for {seconds:g} s on interface {place.interface}, "
            f"domain {place.domain}; is a robot on, or `spikeport robot serve` running, there?"
        )
    for line in heard.lines():
        say(line)
    if heard.problems():
        raise RobotLostError("; ".join(heard.problems()))
