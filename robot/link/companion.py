"""Messages that come beside a robot's states: the truth of a simulation, or odometry."""

from typing import TYPE_CHECKING

import numpy as np

from spikeport.pacing import Clock, SystemClock
from spikeport.robot.link.codec import TICK_S, Base, decode_base
from spikeport.robot.link.messages import ODOMETRY, TRUTHS, Topic
from spikeport.robot.link.odometer import UNTURNED
from spikeport.robot.link.wire import MessageError

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Arrival, Bus, Reader

WAITS_S = 0.01
"""Time in which the message of a state's tick must come."""
PATIENCE_S = 5.0
"""The same time for a message that a run in lock-step needs: the robot waits meanwhile."""
SLICE_S = 0.2
"""The longest wait in one call, which no interrupt ends."""
MOST_M_S = 10.0
"""The fastest robot that odometry is believed to observe, in m/s: twice as fast as one that falls
from 1 m."""
JUMP_M = 0.5
"""The change of place from message to message, in m, that is believed at any speed."""
BESIDE_S = 0.2
"""Age of the last message of a topic beside the states, such as odometry, after which a robot that
is controlled by it is damped: by the clock in real time, by the robot's ticks in lock-step."""
_SERVED_WITH = {TRUTHS: "--truth", ODOMETRY: "--odometer"}
"""The option of `spikeport robot serve` that publishes a topic."""


class Companion:
    """A topic beside the states; the newest message of its first writer counts.

    Parameters
    ----------
    reader : Reader
        The reader of the topic.
    clock : Clock, optional
        The clock for waiting for messages.
    measured : bool
        True for odometry, which is only believed if the robot moves as a robot can.

    Attributes
    ----------
    newest : Base or None
        The newest message; None before the first one.
    came, refused : int
        The numbers of messages that were kept, and that were invalid, another writer's, or not
        believed.
    """

    def __init__(
        self, reader: "Reader", clock: Clock | None = None, measured: bool = False
    ) -> None:
        self._reader, self._measured = reader, measured
        self._clock = SystemClock() if clock is None else clock
        self.newest: Base | None = None
        self.came = self.refused = 0
        self._writer, self._came_s = 0, 0.0
        self._keeps_up = True

    @property
    def published(self) -> bool:
        """True if somebody publishes the topic."""
        return self._reader.n_writers > 0

    def forget(self) -> None:
        """Drop the messages so far, and trust the next writer."""
        self._reader.take()
        self.newest, self._writer = None, 0

    def take(self, tick: int, waits_s: float) -> str | None:
        """Take the messages that came, and wait a while for the message of a tick.

        It was sent before the state of its tick. A publisher whose stamp was behind the last tick
        is not waited for: it has another clock, or sets no stamp.

        Returns
        -------
        str or None
            The reason why a message was refused: a writer other than the first sent it, or the
            robot would move as none can.
        """
        reason = self._accept(0.0)
        if not waits_s:
            return reason
        until_s = self._clock.now() + waits_s
        while self._keeps_up and not self._has(tick):
            left_s = until_s - self._clock.now()
            if left_s <= 0 or not self.published:
                break
            # Not longer: an interrupt is not noticed meanwhile.
            reason = self._accept(min(left_s, SLICE_S)) or reason
        self._keeps_up = self._has(tick)
        return reason

    def _has(self, tick: int) -> bool:
        return self.newest is not None and self.newest.tick >= tick

    def _accept(self, within_s: float) -> str | None:
        """Take the messages of a time; returns the reason if one was refused."""
        reason = None
        for arrival in self._reader.take(within_s):
            reason = self._read(arrival) or reason
        return reason

    def _read(self, arrival: "Arrival") -> str | None:
        """Keep a plausible message of the first writer; returns the reason for another."""
        message, writer = arrival
        if self._writer not in (0, writer):
            self.refused += 1
            return (
                f"came from writer {writer}, earlier ones from writer {self._writer}; only one may "
                "publish on this topic"
            )
        try:
            found = decode_base(message)
        except MessageError:
            self.refused += 1
            return None
        reason = self._disbelieved(found) if self._measured else None
        if reason is not None:
            self.refused += 1
            return reason
        self.newest, self._came_s = found, self._clock.now()
        self.came += 1
        self._writer = writer
        return None

    def _disbelieved(self, found: Base) -> str | None:
        """Return the reason why a robot cannot have moved so; None if it can."""
        speed, before = float(np.linalg.norm(found.velocity)), self.newest
        if speed > MOST_M_S:
            return f"has a robot of {speed:.4g} m/s, limit {MOST_M_S:g}"
        if before is None or found.tick < before.tick:  # a publisher that began anew
            return None
        moved_m = float(np.linalg.norm(found.position - before.position))
        elapsed_s = max(self._clock.now() - self._came_s, TICK_S * (found.tick - before.tick))
        if moved_m <= JUMP_M + MOST_M_S * elapsed_s:
            return None
        return f"moves the robot by {moved_m:.2f} m within {elapsed_s:.3f} s"


class Companions:
    """The topics beside a robot's states, one of which may give its motion.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    needs : Topic or None
        The topic that gives the motion, which a complete observation needs: `TRUTHS`, which only a
        simulation has, or `ODOMETRY`.
    waits : bool
        True to wait for the messages beside a state, as in lock-step.
    """

    def __init__(self, bus: "Bus", needs: Topic | None, waits: bool) -> None:
        # An estimate is compared with the truth of a simulation, which the run does not need. The
        # sport mode of a real robot publishes on the same topic.
        read = {needs} if bus.place.may_be_real else {TRUTHS, needs}
        self._of = {
            topic: Companion(bus.reader(topic), measured=topic is ODOMETRY)
            for topic in (TRUTHS, ODOMETRY)
            if topic in read
        }
        self._needs, self._waits = needs, waits
        # The number of messages of the topic that is needed, and the time of the last one.
        self._came, self._last_s = 0, 0.0

    @property
    def refused(self) -> int:
        """The number of messages that were refused."""
        return sum(one.refused for one in self._of.values())

    def newest(self, topic: Topic) -> Base | None:
        """Return the newest message of a topic; None if it is not read."""
        return self._of[topic].newest if topic in self._of else None

    def forget(self) -> None:
        """Drop the messages so far, and trust the next writers."""
        for one in self._of.values():
            one.forget()

    def take(self, tick: int) -> str | None:
        """Take the messages beside the state of a tick.

        Returns
        -------
        str or None
            The reason why a message was refused: two publish the topic that gives the motion, or
            it has the robot move as none can.
        """
        refused = None
        for topic, one in self._of.items():
            # An odometer may fall silent, which `silence` judges; a truth comes with every state.
            needed = topic is self._needs and topic is TRUTHS
            waits_s = WAITS_S if needed or (self._waits and one.published) else 0.0
            reason = one.take(tick, PATIENCE_S if needed and self._waits else waits_s)
            if reason is not None and topic is self._needs:
                refused = f"a message on {topic.name} {reason}"
        return refused

    def missing(self, begins: bool) -> str:
        """Return what an observation lacks of the topic that it needs; empty if nothing.

        A run ``begins`` with an orientation. A tracker may lose it later: the estimator goes on
        with the last one.
        """
        topic = self._needs
        if topic is None:
            return ""
        newest = self.newest(topic)
        if newest is None:
            return (
                f"nobody publishes {topic.name}; give --estimator ekf, or serve a simulation with "
                f"{_SERVED_WITH[topic]}"
            )
        return UNTURNED if topic is ODOMETRY and begins and not newest.has_orientation else ""

    def watch_from(self, now_s: float) -> None:
        """Let the time of silence begin now."""
        self._last_s = now_s

    def silence(self, now_s: float) -> str | None:
        """Return for how long the topic that gives the motion is silent; None if not too long."""
        if self._needs is None:
            return None
        came = self._of[self._needs].came
        if came != self._came:
            self._came, self._last_s = came, now_s
        age_s = now_s - self._last_s
        if age_s <= BESIDE_S:
            return None
        limits = f"{1000 * age_s:.0f} ms, allowed {1000 * BESIDE_S:.0f} ms"
        return f"nothing on {self._needs.name} for {limits}"
