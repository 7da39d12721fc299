"""Messages that come beside a robot's states: the truth of a simulation, or odometry."""

from typing import TYPE_CHECKING

from spikeport.pacing import Clock, SystemClock
from spikeport.robot.link.codec import Base, decode_base
from spikeport.robot.link.wire import MessageError

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Arrival, Reader

WAITS_S = 0.01
"""Time in which the message of a state's tick must come."""


class Companion:
    """A topic beside the states; the newest message of its first writer counts.

    Parameters
    ----------
    reader : Reader
        The reader of the topic.
    clock : Clock, optional
        The clock for waiting for messages.

    Attributes
    ----------
    newest : Base or None
        The newest message; None before the first one.
    came, refused : int
        The numbers of messages that were kept, and that were invalid or another writer's.
    """

    def __init__(self, reader: "Reader", clock: Clock | None = None) -> None:
        self._reader = reader
        self._clock = SystemClock() if clock is None else clock
        self.newest: Base | None = None
        self.came = self.refused = 0
        self._writer = 0
        self._keeps_up = True

    @property
    def published(self) -> bool:
        """True if somebody publishes the topic."""
        return self._reader.n_writers > 0

    def forget(self) -> None:
        """Drop the messages so far, and trust the next writer."""
        self._reader.take()
        self.newest, self._writer = None, 0

    def take(self, tick: int, waits: bool) -> str | None:
        """Take the messages that came and, if ``waits``, wait a while for the message of a tick.

        It was sent before the state of its tick. A publisher whose stamp was behind the last tick
        is not waited for: it has another clock, or sets no stamp.

        Returns
        -------
        str or None
            The reason why a message was refused: a writer other than the first sent it.
        """
        reason = self._accept(0.0)
        if not waits:
            return reason
        until_s = self._clock.now() + WAITS_S
        while self._keeps_up and not self._has(tick):
            left_s = until_s - self._clock.now()
            if left_s <= 0:
                break
            reason = self._accept(left_s) or reason
        self._keeps_up = self._has(tick)
        return reason

    def _has(self, tick: int) -> bool:
        return self.newest is not None and self.newest.tick >= tick

    def _accept(self, within_s: float) -> str | None:
        """Take the messages of a time; returns the reason if another writer's was refused."""
        reason = None
        for arrival in self._reader.take(within_s):
            reason = self._read(arrival) or reason
        return reason

    def _read(self, arrival: "Arrival") -> str | None:
        """Keep a message of the first writer; returns the reason if another writer sent it."""
        message, writer = arrival
        if self._writer not in (0, writer):
            self.refused += 1
            return (
                f"came from writer {writer}, earlier ones from writer {self._writer}; only one may "
                "publish on this topic"
            )
        try:
            self.newest = decode_base(message)
        except MessageError:
            self.refused += 1
            return None
        self.came += 1
        self._writer = writer
        return None
