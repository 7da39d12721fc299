"""Points on a Dask cluster. Anyone who reaches its scheduler can run code as its owner, and as us.

With ``tls://`` both sides need certificates, which Dask's configuration names. With ``tcp://``
there is only the cluster's own security.
"""

import contextlib
import gc
import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence

import dask
from distributed import Client, Future, get_worker, wait
from distributed.scheduler import KilledWorker

from spikeport.errors import BackendError, SpikeportError, UsageError
from spikeport.experiments.sweep.folder import PointFiles
from spikeport.experiments.sweep.plan import Point
from spikeport.experiments.sweep.queue import Queue
from spikeport.experiments.sweep.workers import PointOutcome, Run, died

ANSWER_S = 5
"""The time a scheduler has to answer, and a cluster to have a worker."""

PATIENCE_S = 60
"""The time a sweep waits without any worker: Dask usually restarts workers that died."""

LOOK_S = 0.5
"""The time between looks for workers; one that a point kills is there for about a second."""

TLS = "tls://"

CONFIG = {
    "distributed.comm.timeouts.connect": f"{ANSWER_S}s",
    "scheduler": None,  # restored at the end: a closed client may leave it, and xarray looks here
}


@contextlib.contextmanager
def outcomes(
    scheduler: str, points: Sequence[Point], run: Run
) -> Iterator[Iterator[tuple[Point, PointOutcome]]]:
    """Open a cluster, and yield every point as it ends, with its files or the reason it failed.

    Raises
    ------
    UsageError
        If the scheduler does not answer or has no worker, or a worker has several threads.
    BackendError
        If no worker is left while points are run.
    """
    with dask.config.set(CONFIG), _silent(), _opened(scheduler) as client:
        _check(client, scheduler)
        yield _outcomes(client, points, run)


@contextlib.contextmanager
def _opened(scheduler: str) -> Iterator[Client]:
    client = _connected(scheduler)
    if client is None:
        # Close the client that could not connect now. Later, while another client starts in this
        # thread, its close would wait for ever for the lock that the start holds.
        gc.collect()
        keys = " with the certificates that Dask's configuration names (distributed.comm.tls)"
        raise UsageError(
            f"--scheduler {scheduler}: no Dask scheduler answers within {ANSWER_S} s"
            f"{keys if scheduler.startswith(TLS) else ''}; start one with `dask scheduler`, or "
            "leave --scheduler out for processes on this machine"
        )
    with client:
        yield client


def _connected(scheduler: str) -> Client | None:
    """Return a client of a scheduler; None if it does not answer as one."""
    try:
        return Client(scheduler, timeout=ANSWER_S)
    except Exception:  # a server that is no scheduler confuses Dask in many ways
        return None


def _check(client: Client, scheduler: str) -> None:
    with contextlib.suppress(TimeoutError):
        client.wait_for_workers(1, timeout=ANSWER_S)
    threads = client.nthreads().values()
    # Points side by side in the threads of one process would wait for each other.
    if set(threads) != {1}:
        found = "has no worker" if not threads else f"has a worker with {max(threads)} threads"
        raise UsageError(
            f"--scheduler {scheduler}: {found}, but each point needs a process of its own; start "
            f"workers with `dask worker {scheduler} --nthreads 1`"
        )


def _outcomes(
    client: Client, points: Sequence[Point], run: Run
) -> Iterator[tuple[Point, PointOutcome]]:
    """Yield outcomes, with no more points under way than there are workers.

    Otherwise a point that kills its worker would also lose results the worker still holds.
    """
    waiting, running = Queue(points), dict[Future, Point]()
    on_worker = _in_its_folder(run)

    def submit(made: str | None) -> None:
        """Submit points; the free worker is most likely the one that made the network ``made``."""
        free = len(client.nthreads()) - len(running)
        for _ in range(max(free, 0 if running else 1)):
            if waiting:
                point = waiting.take(made)
                # not pure: Dask must not return another sweep's outcome for an equal point
                running[client.submit(on_worker, point, pure=False)] = point

    submit(None)
    while running:
        for future in _ended(client, running):
            point = running.pop(future)
            yield point, _outcome(future)
            submit(point.network)


def _in_its_folder(run: Run) -> Callable[[Point], PointFiles]:
    """Return a function that runs a point in the folder of its worker."""

    def on_worker(point: Point) -> PointFiles:
        return run(point, get_worker().local_directory)

    return on_worker


def _ended(client: Client, running: Iterable[Future]) -> Iterable[Future]:
    """Wait for futures to end, and return the ended ones; raises BackendError without workers."""
    seen_s = time.monotonic()
    while True:
        try:
            done: Iterable[Future] = wait(
                list(running), timeout=LOOK_S, return_when="FIRST_COMPLETED"
            ).done
        except TimeoutError:
            if client.nthreads():
                seen_s = time.monotonic()
            elif time.monotonic() - seen_s > PATIENCE_S:
                raise BackendError(
                    "no worker is left, and none came back; cure: run the same command again: it "
                    "continues with the unfinished points"
                ) from None
        else:
            return done


def _outcome(future: Future) -> PointOutcome:
    error = future.exception()
    if error is None:
        kept: PointFiles = future.result()
        return kept
    if isinstance(error, KilledWorker):
        return died(error.allowed_failures + 1, "fewer workers on a machine of the cluster")
    return str(error) if isinstance(error, SpikeportError) else repr(error)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Silence Dask's log of workers that come and go: failed points are reported by us."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)
