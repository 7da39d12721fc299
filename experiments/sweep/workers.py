"""Points in processes of this machine, which communicate through private pipes only.

No port is opened: anyone who can connect to a worker can make it run code as its owner, and on a
machine of many users each of them can reach the loopback. A process runs one point after the other,
in one thread. A process that dies costs its point an attempt, and is replaced.
"""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from typing import NamedTuple

from spikeport.errors import SpikeportError
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.queue import Queue
from spikeport.experiments.sweep.scratch import scratch_folder
from spikeport.interrupts import uninterruptible

PointOutcome = PointFiles | str
"""The files of a point, or the reason why it failed."""

Run = Callable[[Point, str], PointFiles]
"""A function that runs a point in a folder, where it may leave any files."""

ALLOWED_DEATHS = 2
"""The deaths of workers that a point is allowed; at the next one it is given up."""

END_S = 5
"""The time a worker has to end when it is asked to, before it is killed."""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""The environment of a worker: points side by side share the cores."""

SPAWN = multiprocessing.get_context("spawn")
"""New processes, since the fork of a process with threads may hang, and would share its pipes."""


def died(times: int, cure: str, how: str = "") -> str:
    """Return the reason for giving up a point; ``cure`` helps if memory ran out."""
    by = f" ({how})" if how else ""
    return f"its worker died {times} times{by}; cure: {cure}, if memory ran out"


@contextlib.contextmanager
def outcomes(
    n_workers: int, points: Sequence[Point], run: Run
) -> Iterator[Iterator[tuple[Point, PointOutcome]]]:
    """Start workers, and yield every point as it ends, with its files or the reason it failed.

    Workers end with the block, even in the middle of a point.
    """
    with scratch_folder() as scratch, contextlib.closing(_Pool(n_workers, run, scratch)) as pool:
        yield pool.outcomes(points)


class _Worker(NamedTuple):
    """A process and our end of its pipe."""

    process: multiprocessing.process.BaseProcess
    pipe: Connection

    def end(self) -> str:
        """End the process, and return how it ended."""
        self.pipe.close()
        # Ask it to end first, and kill it if it does not end in time.
        self.process.terminate()
        self.process.join(END_S)
        self.process.kill()
        self.process.join()
        code = self.process.exitcode or 0
        return f"exit code {code}" if code >= 0 else signal.Signals(-code).name


class _Pool:
    """Workers, and the points they run."""

    def __init__(self, n_workers: int, run: Run, scratch: str) -> None:
        self._run, self._scratch = run, scratch
        self._idle: dict[_Worker, str | None] = {}  # with the network that each has made
        self._running: dict[_Worker, Point] = {}
        try:
            for _ in range(n_workers):
                self._idle[self._started()] = None
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End all workers."""
        for worker in (*self._idle, *self._running):
            worker.process.terminate()
        for worker in (*self._idle, *self._running):
            worker.end()

    def outcomes(self, points: Sequence[Point]) -> Iterator[tuple[Point, PointOutcome]]:
        """Yield every point as it ends."""
        waiting, deaths = Queue(points), Counter[str]()
        while waiting or self._running:
            while waiting and self._idle:
                self._submit(waiting)
            for worker in self._ended():
                point = self._running.pop(worker)
                outcome, how = self._outcome(worker, point)
                if outcome is None:
                    deaths[point.name] += 1
                    if deaths[point.name] <= ALLOWED_DEATHS:
                        waiting.put(point)
                        continue
                    outcome = died(deaths[point.name], "fewer --workers", how)
                yield point, outcome

    def _submit(self, waiting: Queue) -> None:
        worker, network = self._idle.popitem()
        # A point with the network that the worker made last, if one waits.
        point = waiting.take(network)
        with contextlib.suppress(OSError):  # it died while it was idle: reading its pipe shows this
            worker.pipe.send(point)
        self._running[worker] = point

    def _ended(self) -> list[_Worker]:
        """Wait until workers have ended a point, or have died, and return these."""
        ready = wait([worker.pipe for worker in self._running])
        return [worker for worker in self._running if worker.pipe in ready]

    def _outcome(self, worker: _Worker, point: Point) -> tuple[PointOutcome | None, str]:
        """Return the outcome of a worker's point; or None, and how the worker died."""
        try:
            outcome: PointOutcome = worker.pipe.recv()
        except (EOFError, OSError):
            how = worker.end()
            self._idle[self._started()] = None
            return None, how
        self._idle[worker] = point.network
        return outcome, ""

    def _started(self) -> _Worker:
        ours, theirs = SPAWN.Pipe()
        arguments = (theirs, self._run, self._scratch)
        process = SPAWN.Process(target=_serve, args=arguments, daemon=True)
        with uninterruptible(), _environment(ONE_THREAD):
            process.start()
        # Otherwise this process would hold the worker's end open, and never see it close.
        theirs.close()
        return _Worker(process, ours)


def _serve(pipe: Connection, run: Run, scratch: str) -> None:
    """Run points, one after the other, until the pipe ends or the parent does."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(_attempt(run, pipe.recv(), scratch))


def _attempt(run: Run, point: Point, scratch: str) -> PointOutcome:
    try:
        return run(point, scratch)
    except SpikeportError as error:
        return str(error)
    except BaseException as error:  # an exit also ends the point alone, and not the worker
        return repr(error)


def _end_with_parent() -> None:
    """End this process when its parent is killed, even in the middle of a point."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextlib.contextmanager
def _environment(changed: Mapping[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
