"""The two clocks of a link: simulated time waits for the board, real time does not.

In simulated time a run is a function of its seeds, whatever the board takes. In real time step n
begins at t_0 + n dt; an answer that is not there when the next step begins is replaced by the one
before it, for a few steps.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spikeport.backends.board.line import Clock

ASKS = 3
"""How often a step of real time is asked for before it is over."""


@dataclass(frozen=True)
class SimulatedTime:
    """The clock that waits.

    Attributes
    ----------
    patience_s : float
        Time after which a board that does not answer is given up.
    """

    patience_s: float = 10.0
    hold: ClassVar[int] = 0
    ask_again_s: ClassVar[float] = 0.5

    @property
    def limit(self) -> str:
        """The time after which the board is given up, in words."""
        return f"{self.patience_s:g} s"


WAITING = SimulatedTime()
"""The clock of a run that is a function of its seeds."""


@dataclass(frozen=True)
class RealTime:
    """The clock that does not wait.

    Attributes
    ----------
    period_s : float
        Length of a step.
    hold : int
        Steps for which the last outputs are held when the board is late; then it is given up.
    """

    period_s: float
    hold: int = 5

    @property
    def limit(self) -> str:
        """The time after which the board is given up, in words."""
        return f"{self.hold + 1} steps of {1000 * self.period_s:g} ms"

    @property
    def ask_again_s(self) -> float:
        """Time after which a step is asked for again."""
        return self.period_s / ASKS


Timing = SimulatedTime | RealTime


class Pace:
    """The beginnings of steps by a clock: t_0 + n dt, whatever the steps before took.

    A step that begins late is an overrun. After a stall of a step or more time goes on from there:
    the steps that were missed are not made up for in a burst.

    Parameters
    ----------
    timing : SimulatedTime or RealTime
        The clock's rule; steps of simulated time begin when they are asked for.
    clock : Clock
        The clock.

    Attributes
    ----------
    overruns : int
        The steps that began late.
    """

    def __init__(self, timing: Timing, clock: Clock) -> None:
        self._timing, self._clock = timing, clock
        self._due_s: float | None = None
        self.overruns = 0

    def begin(self) -> float:
        """Wait for the beginning of the next step, and return the time at which it ends."""
        now = self._clock.now()
        if isinstance(self._timing, SimulatedTime):
            return now + self._timing.patience_s
        period_s = self._timing.period_s
        due_s = now if self._due_s is None else self._due_s + period_s
        if now > due_s:
            self.overruns += 1
            due_s = now if now - due_s >= period_s else due_s
        self._clock.sleep_until(due_s)
        self._due_s = due_s
        return due_s + period_s


class RoundTrips:
    """Times of round trips, in bins of 2 %: memory does not grow with the number of steps."""

    FIRST_S = 1e-6
    RATIO = 1.02
    N = 1200  # up to 21,000 s
    KEPT = 1000  # until they are put into bins together

    def __init__(self) -> None:
        self._kept: list[float] = []
        self._bins = np.zeros(self.N, dtype=np.int64)
        self._worst_s = 0.0

    def add(self, time_s: float) -> None:
        """Count a round trip."""
        self._kept.append(time_s)
        if len(self._kept) == self.KEPT:
            self._count()

    def _count(self) -> None:
        """Put the times that are kept into their bins."""
        if self._kept:
            times_s = np.maximum(self._kept, self.FIRST_S)
            bins = np.log(times_s / self.FIRST_S) / np.log(self.RATIO)
            np.add.at(self._bins, np.minimum(bins.astype(int), self.N - 1), 1)
            self._worst_s = max(self._worst_s, *self._kept)
            self._kept.clear()

    def quantile_s(self, share: float) -> float | None:
        """Return the time below which a share of the round trips stayed; None without any."""
        self._count()
        total = int(self._bins.sum())
        if total == 0:
            return None
        number = int(np.searchsorted(self._bins.cumsum(), share * total))
        return min(float(self.FIRST_S * self.RATIO ** (number + 1)), self._worst_s)

    @property
    def worst_s(self) -> float:
        """The longest round trip; 0 without any."""
        self._count()
        return self._worst_s
