"""Dask's workers: processes on this machine, or those of a cluster."""

import contextlib
import logging
import signal
import tempfile
from collections.abc import Iterator
from multiprocessing import resource_tracker

import dask
from distributed import Client, LocalCluster

from spikeport.errors import UsageError

LOCAL = "127.0.0.1"
ANSWER_S = 5
"""How long a scheduler may take to answer, and a cluster to show a worker."""

ALLOWED_DEATHS = 2
"""How often the worker of a point may die before the point is given up at the next time."""

CONFIG = {
    "distributed.scheduler.allowed-failures": ALLOWED_DEATHS,
    "distributed.scheduler.worker-saturation": 1.0,  # a point that waits is not blamed for a death
    "distributed.comm.timeouts.connect": f"{ANSWER_S}s",
    "scheduler": None,  # taken back at the end: a closed client may leave it, and xarray looks here
}


@contextlib.contextmanager
def workers(scheduler: str | None, n_local: int) -> Iterator[Client]:
    """Open a client of a cluster's scheduler, or of processes that end with it.

    Each worker runs one point at a time, in one thread.

    Raises
    ------
    UsageError
        If the scheduler does not answer, or its workers are none or run several points at a time.
    """
    opened = _local(n_local) if scheduler is None else _remote(scheduler)
    with dask.config.set(CONFIG), _silent(), opened as client:
        yield client


@contextlib.contextmanager
def _local(n: int) -> Iterator[Client]:
    with tempfile.TemporaryDirectory(prefix="spikeport-sweep-") as scratch:
        with _uninterruptible():
            cluster = LocalCluster(
                n_workers=n,
                threads_per_worker=1,
                host=LOCAL,
                dashboard_address=f"{LOCAL}:0",  # by default 8787, and a warning where it is taken
                silence_logs=logging.CRITICAL,
                local_directory=scratch,
            )
        with cluster, Client(cluster) as client:
            yield client


@contextlib.contextmanager
def _uninterruptible() -> Iterator[None]:
    """Block SIGINT; threads begun meanwhile, and processes of theirs, keep it so.

    A terminal interrupts workers too, which would say so at length; this process ends them.
    """
    resource_tracker.ensure_running()  # starting it later would unblock the signal
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


@contextlib.contextmanager
def _remote(scheduler: str) -> Iterator[Client]:
    try:
        client = Client(scheduler, timeout=ANSWER_S)
    except Exception:  # what answers but is no scheduler confuses Dask in many ways
        raise UsageError(
            f"--scheduler {scheduler}: no Dask scheduler answers within {ANSWER_S} s; start one "
            "with `dask scheduler`, or leave --scheduler out for processes on this machine"
        ) from None
    with client:
        _check(client, scheduler)
        yield client


def _check(client: Client, scheduler: str) -> None:
    with contextlib.suppress(TimeoutError):
        client.wait_for_workers(1, timeout=ANSWER_S)
    threads = client.nthreads().values()
    if set(threads) != {1}:
        found = "has no worker" if not threads else f"has a worker of {max(threads)} threads"
        raise UsageError(
            f"--scheduler {scheduler}: {found}, but each point needs a process of its own; start "
            f"workers with `dask worker {scheduler} --nthreads 1`"
        )


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
