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
    """A topic beside the states, of which the newest message of the first writer counts.

    Parameters
    ----------
    reader : Reader
        The reader of the topic.
    clock : Clock, optional
        The clock by which messages are waited for.

    Attributes
    ----------
    newest : Base or None
        The newest; None if there was none yet.
    came, refused : int
        Messages that came, and that were none or another writer's.
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
        """True if somebody publishes it."""
        return self._reader.n_writers > 0

    def forget(self) -> None:
        """Drop what came until now, and trust whoever writes next."""
        self._reader.take()
        self.newest, self._writer = None, 0

    def take(self, tick: int, waits: bool) -> str | None:
        """Take what came, and, where that waits, what comes in time until that of a tick.

        It was sent before the state of its tick. Nothing is waited for from a publisher whose stamp
        was behind the last tick: it has another clock, or sets none.

        Returns
        -------
        str or None
            Why a message was refused: another writer than the first sent it.
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
        """Take what comes within a time; returns why a message was refused as another writer's."""
        reason = None
        for arrival in self._reader.take(within_s):
            reason = self._read(arrival) or reason
        return reason

    def _read(self, arrival: "Arrival") -> str | None:
        """Keep a message; returns why not if it is another writer's. The first one is trusted."""
        message, writer = arrival
        if self._writer not in (0, writer):
            self.refused += 1
            return f"written by {writer}, before by {self._writer}; only one may publish there"
        try:
            self.newest = decode_base(message)
        except MessageError:
            self.refused += 1
            return None
        self.came += 1
        self._writer = writer
        return None
