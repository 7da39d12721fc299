"""Messages that come beside a robot's states: the truth of a simulation, or odometry."""

from typing import TYPE_CHECKING

from spikeport.robot.link.codec import Base, decode_base
from spikeport.robot.link.wire import MessageError

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Reader

WAITS_S = 0.01
"""Time between two messages after which none is waited for."""


class Companion:
    """A topic beside the states, of which the newest message counts.

    Parameters
    ----------
    reader : Reader
        The reader of the topic.

    Attributes
    ----------
    newest : Base or None
        The newest; None if there was none yet.
    came, damaged : int
        Messages that came, and that were none.
    """

    def __init__(self, reader: "Reader") -> None:
        self._reader = reader
        self.newest: Base | None = None
        self.came = self.damaged = 0

    @property
    def published(self) -> bool:
        """True if somebody publishes it."""
        return bool(self._reader.writers)

    def take(self, tick: int, waits: bool) -> None:
        """Take what came, and, where that waits, what comes until that of a tick.

        It was sent before the state of its tick.
        """
        within_s = 0.0
        while self._accept(within_s) or not within_s:
            if not waits or (self.newest is not None and self.newest.tick >= tick):
                return
            within_s = WAITS_S

    def _accept(self, within_s: float) -> bool:
        """Take what comes within a time; returns False for nothing."""
        arrivals = self._reader.take(within_s)
        for arrival in arrivals:
            try:
                self.newest = decode_base(arrival.message)
                self.came += 1
            except MessageError:
                self.damaged += 1
        return bool(arrivals)
