"""Several processes that train one policy.

Each has its share of the robots. PPO averages their gradients before every step of its optimiser,
so that all have the same weights. On n cores this is nearly n times as fast as one process, unlike
threads within the calls of torch and MuJoCo.
"""

import multiprocessing
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import timedelta
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple, TypeVarTuple

from torch import distributed

from spikeport.errors import WorkerLostError
from spikeport.interrupts import uninterruptible

ENDS_S = 1.0
"""Time in which a process that is gone has ended for good."""
MEETING = timedelta(minutes=5)
"""Time in which all processes must meet: one that died at its start would be awaited for ever."""
ANSWER = timedelta(days=7)
"""Time in which each must answer another. A process that dies is noticed at once; one waits long
while the first one evaluates, or while a user has suspended them, or the machine."""
Arguments = TypeVarTuple("Arguments")


class Worker(NamedTuple):
    """One of several processes; the first one, with ``rank`` 0, keeps the run's files."""

    rank: int = 0
    world_size: int = 1

    def join(self, meeting: str) -> None:
        """Join the other workers; ``meeting`` is the path of a file that all can reach."""
        store = distributed.FileStore(meeting, self.world_size)
        store.set(str(self.rank), "here")
        store.wait([str(rank) for rank in range(self.world_size)], MEETING)
        distributed.init_process_group(
            "gloo", store=store, rank=self.rank, world_size=self.world_size, timeout=ANSWER
        )


ALONE = Worker()


@contextmanager
def others(
    number: int, work: Callable[[Worker, *Arguments], object], *args: *Arguments
) -> Iterator[None]:
    """Let ``number`` other processes do ``work(worker, *args)`` beside this one, the first.

    Raises
    ------
    WorkerLostError
        One of them has ended before its work.
    """
    if not number:
        yield
        return
    # A fork would copy torch's and MuJoCo's threads in the middle of their work.
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as folder:
        meeting = str(Path(folder) / "meeting")
        first, *helpers = (Worker(rank, number + 1) for rank in range(number + 1))
        processes = [
            spawn.Process(target=_help, args=(worker, meeting, work, args), daemon=True)
            for worker in helpers
        ]
        with _running(processes), _group(first, meeting, processes):
            yield


@contextmanager
def _running(processes: Sequence[BaseProcess]) -> Iterator[None]:
    """Start processes, and end them; if one cannot be started, also the ones before it."""
    begun = []
    try:
        # If they were interrupted, too, each would print an error of its own.
        with uninterruptible():
            for process in processes:
                process.start()
                begun.append(process)
        yield
    finally:
        for process in begun:
            process.terminate()
            process.join()


@contextmanager
def _group(first: Worker, meeting: str, processes: Sequence[BaseProcess]) -> Iterator[None]:
    """Join the other processes; raise a WorkerLostError if one of them ends before its work."""
    try:
        first.join(meeting)
        yield
    except RuntimeError as error:  # torch's, if a process is gone
        _refuse_dead(processes, error)
        raise
    finally:
        if distributed.is_initialized():
            distributed.destroy_process_group()


def _refuse_dead(processes: Sequence[BaseProcess], error: RuntimeError) -> None:
    """Raise a WorkerLostError if one of the processes has ended, as for lack of memory."""
    for number, process in enumerate(processes, 2):
        process.join(ENDS_S)
        if process.exitcode is not None:
            raise WorkerLostError(
                f"process {number} of {len(processes) + 1} ended with exit code "
                f"{process.exitcode}; finished segments are kept: give the same command again"
            ) from error


def _help(
    worker: Worker,
    meeting: str,
    work: Callable[[Worker, *Arguments], object],
    args: tuple[*Arguments],
) -> None:
    worker.join(meeting)
    work(worker, *args)
