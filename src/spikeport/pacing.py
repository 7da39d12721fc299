"""Steps by a clock: absolute deadlines without bursts, times of round trips, a timer."""

import contextlib
import gc
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from spikeport.errors import UsageError


class Clock(Protocol):
    """A clock in s; only differences of its times have a meaning."""

    def now(self) -> float:
        """Return the time, in s."""

    def sleep_until(self, time_s: float) -> None:
        """Wait until a time; at once if it has passed."""


class SystemClock:
    """The clock of this machine."""

    def now(self) -> float:
        """Return the time, in s."""
        return time.perf_counter()

    def sleep_until(self, time_s: float) -> None:
        """Wait until a time; at once if it has passed."""
        left = time_s - time.perf_counter()
        if left > 0:
            time.sleep(left)


@contextlib.contextmanager
def later(delay_s: float, action: Callable[[], object]) -> Iterator[None]:
    """Call ``action`` after a delay in a thread of its own, unless the block ends before."""
    timer = threading.Timer(delay_s, action)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


@dataclass(frozen=True)
class Pace:
    """The pace of steps in real time.

    Attributes
    ----------
    period_s : float
        Time from one step to the next.
    clock : Clock
        The clock.
    priority : int or None
        The real-time priority of the process; see `undisturbed`.
    shared : bool
        True if steps wait for another clock, too, such as a board's, which began at another moment:
        a step that begins late is then no overrun, unless it missed a whole period.
    """

    period_s: float
    clock: Clock = field(default_factory=SystemClock)
    priority: int | None = None
    shared: bool = False


@contextlib.contextmanager
def undisturbed(priority: int | None = None) -> Iterator[None]:
    """Keep other work away from steps that keep to the clock.

    Garbage collection skips the objects that exist already: one collection of a run's 315,000
    objects takes 0.2 s, and a robot waits 0.04 s. With a priority the threads that exist already,
    and those that they start, run before all work without a priority (SCHED_FIFO).

    Parameters
    ----------
    priority : int, optional
        A real-time priority from 1 to 99; the larger comes first.

    Raises
    ------
    UsageError
        If the system does not grant the priority to this process.
    """
    before = {} if priority is None else _schedules()
    if priority is not None:
        _raise_priority(before, priority)
    # Collect first, since frozen garbage stays.
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        for thread, (policy, its_own) in before.items():
            _schedule(thread, policy, its_own)


def _schedules() -> dict[int, tuple[int, int]]:
    """Return the scheduling policy and priority of each thread of this process."""
    schedules = {}
    # The system's list: threads of libraries, such as DDS, are unknown to Python.
    for thread in map(int, os.listdir("/proc/self/task")):
        with contextlib.suppress(ProcessLookupError):  # it has ended since
            policy = os.sched_getscheduler(thread)
            schedules[thread] = policy, os.sched_getparam(thread).sched_priority
    return schedules


def _raise_priority(threads: Iterable[int], priority: int) -> None:
    """Give threads a real-time priority; UsageError if the system refuses."""
    try:
        for thread in threads:
            _schedule(thread, os.SCHED_FIFO, priority)
    except PermissionError:
        raise UsageError(
            f"priority {priority}: the system gives this process no real-time priority; cure: "
            "start it with the capability for it, `sudo setpriv --reuid $USER --regid $USER "
            "--init-groups --inh-caps +sys_nice --ambient-caps +sys_nice $(which spikeport) ...`"
        ) from None


def _schedule(thread: int, policy: int, priority: int) -> None:
    with contextlib.suppress(ProcessLookupError):  # it has ended since
        os.sched_setscheduler(thread, policy, os.sched_param(priority))


class Deadlines:
    """The beginnings of steps by a clock: t_0 + n dt, however long earlier steps took.

    A step that begins late is an overrun. After a stall of a step or more the deadlines start again
    from that time: the steps that were missed are not made up for in a burst.

    Parameters
    ----------
    period_s : float
        The time dt from one step to the next.
    clock : Clock
        The clock.

    Attributes
    ----------
    overruns : int
        The steps that began late.
    """

    def __init__(self, period_s: float, clock: Clock) -> None:
        self._period_s, self._clock = period_s, clock
        self._due_s: float | None = None
        self.overruns = 0

    def begin(self, *, waited: bool = False) -> float:
        """Wait for the beginning of the next step, and return the time at which it ends.

        Parameters
        ----------
        waited : bool
            True if the caller waited until the end of the last step. It wakes a little later, which
            is no overrun unless it missed a whole step.
        """
        now, period_s = self._clock.now(), self._period_s
        due_s = now if self._due_s is None else self._due_s + period_s
        if now > due_s:
            missed = now - due_s >= period_s
            self.overruns += missed or not waited
            due_s = now if missed else due_s
        self._clock.sleep_until(due_s)
        self._due_s = due_s
        return due_s + period_s


class RoundTrips:
    """Times of round trips, in bins of 2 %: memory does not grow with the number of steps."""

    FIRST_S = 1e-6
    RATIO = 1.02
    N = 1200  # up to 21,000 s
    KEPT = 1000  # times that are put into bins together

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
        # The upper end of its bin: no round trip counts as shorter than it was.
        number = int(np.searchsorted(self._bins.cumsum(), share * total))
        return min(float(self.FIRST_S * self.RATIO ** (number + 1)), self._worst_s)

    @property
    def worst_s(self) -> float:
        """The longest round trip; 0 without any."""
        self._count()
        return self._worst_s

    def summary_us(self) -> dict[str, float | None]:
        """Return median, 99th percentile and worst, in us; None if there was no round trip."""
        found = {"median": self.quantile_s(0.5), "p99": self.quantile_s(0.99)}
        return {
            **{name: None if t is None else round(1e6 * t, 1) for name, t in found.items()},
            "worst": round(1e6 * self.worst_s, 1),
        }
