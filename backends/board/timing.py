"""The two clocks of a link: simulated time waits for the board, real time does not.

In simulated time a run is a function of its seeds, however long the board takes. In real time step
n begins at t_0 + n dt. If an answer is not there when the next step begins, the previous answer
replaces it, for a few steps.
"""

from dataclasses import dataclass
from typing import ClassVar

from spikeport.counted import counted
from spikeport.pacing import Clock, Deadlines

ASKS = 3
"""The number of times that the host asks for a step of real time before the step is over."""


@dataclass(frozen=True)
class SimulatedTime:
    """The clock that waits for the board.

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
    """The clock that does not wait for the board.

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
    def patience_s(self) -> float:
        """Time after which a board that does not answer is given up."""
        return (self.hold + 1) * self.period_s

    @property
    def limit(self) -> str:
        """The time after which the board is given up, in words."""
        return f"{counted(self.hold + 1, 'step')} of {1000 * self.period_s:g} ms"

    @property
    def ask_again_s(self) -> float:
        """Time after which a step is asked for again."""
        return self.period_s / ASKS


Timing = SimulatedTime | RealTime


class StepDeadlines:
    """The deadlines of a chip's steps by a clock; see `spikeport.pacing.Deadlines`.

    Parameters
    ----------
    timing : SimulatedTime or RealTime
        The clock's rule; steps of simulated time begin when they are asked for.
    clock : Clock
        The clock.
    """

    def __init__(self, timing: Timing, clock: Clock) -> None:
        self._clock = clock
        self._deadlines: Deadlines | None = None
        if isinstance(timing, RealTime):
            self._deadlines = Deadlines(timing.period_s, clock)
        else:
            self._patience_s = timing.patience_s

    @property
    def overruns(self) -> int:
        """The steps that began late."""
        return 0 if self._deadlines is None else self._deadlines.overruns

    def begin(self, *, waited: bool = False) -> float:
        """Wait for the beginning of the next step, and return its end; see `Deadlines.begin`."""
        if self._deadlines is None:
            return self._clock.now() + self._patience_s
        return self._deadlines.begin(waited=waited)
