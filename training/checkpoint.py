"""Checkpoints of a training run: one file per segment, from which it goes on exactly."""

import pickle
from pathlib import Path
from typing import Any, NamedTuple

import torch

from spikeport.atomic import atomic_path
from spikeport.errors import UsageError

Entry = dict[str, Any]
"""A line of the log: the figures of a segment, by name."""


class Checkpoint(NamedTuple):
    """The run after a segment.

    Attributes
    ----------
    options : dict
        The settings that the run must not change when it goes on: seed, sizes.
    segment : int
        Number of segments done.
    learner : dict
        State of the networks and of their optimiser.
    log : list of dict
        Figures of every segment so far.
    """

    options: dict[str, object]
    segment: int
    learner: dict[str, object]
    log: list[Entry]


def path_of(folder: Path, segment: int) -> Path:
    """Return the path of the checkpoint of a segment."""
    return folder / "checkpoints" / f"{segment:05d}.pt"


def save(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint, whole or not at all."""
    with atomic_path(path_of(folder, checkpoint.segment)) as temporary:
        torch.save(checkpoint._asdict(), temporary)


def load(path: Path) -> Checkpoint:
    """Read a checkpoint; raises `UsageError` for a file that is none."""
    try:
        return Checkpoint(**torch.load(path, weights_only=True))
    except (RuntimeError, TypeError, EOFError, pickle.UnpicklingError) as error:
        raise UsageError(
            f"'{path}' is not a checkpoint of this version ({type(error).__name__}); "
            "delete it to go on from the one before, or choose another --out"
        ) from error


def latest(folder: Path) -> Path | None:
    """The last checkpoint of a run, if there is one."""
    return max(folder.glob("checkpoints/*.pt"), default=None)
