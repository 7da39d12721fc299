"""Work for processes that train together: they import torch, and nothing that takes as long."""

import os
import signal
import time
from pathlib import Path

import torch
from torch import distributed

from spikeport.training.workers import Worker


def add(worker: Worker, values: list[float]) -> float:
    """Return the sum of one value of every worker."""
    total = torch.tensor(values[worker.rank])
    distributed.all_reduce(total)
    return total.item()


def note_mask(worker: Worker, folder: Path) -> None:
    """Note whether a worker may be interrupted, and wait for the others."""
    blocked = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    (folder / str(worker.rank)).write_text(str(blocked))
    distributed.barrier()


def die(_worker: Worker) -> None:
    """End as for lack of memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def answer_late(worker: Worker) -> None:
    """Take part in a sum after a while."""
    time.sleep(3)
    add(worker, [1.0, 10.0])
