"""Checkpoints of a training run: one file per segment, from which the run continues exactly."""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import torch

from spikeport.atomic import atomic_path
from spikeport.errors import UsageError
from spikeport.reading.archive import Archive, UnreadableError, read_bytes
from spikeport.reading.mismatch import MismatchError, shown

Entry = dict[str, Any]
"""A line of the log: the figures of a segment, by name."""


class Checkpoint(NamedTuple):
    """The run after a segment.

    Attributes
    ----------
    options : dict
        The settings that must not change when the run continues: seed, sizes.
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
    return folder / "checkpoints" / f"{_stem(segment)}.pt"


def _stem(segment: int) -> str:
    return f"{segment:05d}"


def save(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint, whole or not at all."""
    # In memory first: torch's error of a full disk does not say that the disk is full.
    content = io.BytesIO()
    torch.save(checkpoint._asdict(), content)
    with atomic_path(path_of(folder, checkpoint.segment)) as temporary:
        temporary.write_bytes(content.getbuffer())


def load(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises
    ------
    UsageError
        The file is not a checkpoint, is damaged, or has the name of another segment.
    """
    with refusing(path):
        found = Checkpoint(**torch.load(io.BytesIO(_undamaged(path)), weights_only=True))
        _check(found)
        if path.stem != _stem(found.segment):
            raise MismatchError(f"a file {_stem(found.segment)}.pt, by its segment", path.name)
        return found


@contextlib.contextmanager
def refusing(path: Path) -> Iterator[None]:
    """Raise `UsageError` for any error while a checkpoint is read or restored."""
    try:
        yield
    except Exception as error:  # torch raises anything for a file that it did not write
        ours = isinstance(error, MismatchError | UnreadableError)
        reason = str(error) if ours else type(error).__name__
        raise UsageError(
            f"'{path}' is not a checkpoint of this version ({reason}); "
            "delete it to go on from the one before, or choose another --out"
        ) from error


def _undamaged(path: Path) -> bytes:
    """Return the content of a file after checking its checksums, which torch does not do."""
    content = read_bytes(path)
    archive = Archive(content)
    for name in archive.names:
        archive.read(name, archive.size)
    return content


def _check(found: Checkpoint) -> None:
    if not isinstance(found.options, dict) or not isinstance(found.learner, dict):
        raise MismatchError("options and a learner", "other values")
    if type(found.segment) is not int or found.segment < 1:
        raise MismatchError("a number of segments", shown(found.segment))
    if not isinstance(found.log, list) or not all(map(_is_entry, found.log)):
        raise MismatchError("a log of segments", "another value")


def _is_entry(entry: object) -> bool:
    kinds = {"segment": int, "step": int, "stage": str}
    return isinstance(entry, dict) and all(
        isinstance(entry.get(name), kind) for name, kind in kinds.items()
    )


def latest(folder: Path) -> Path | None:
    """Return the last checkpoint of a run, if there is one; other names are the user's copies."""
    found = (path for path in folder.glob("checkpoints/*.pt") if path.stem.isdecimal())
    own = (path for path in found if path.stem == _stem(int(path.stem)))
    return max(own, key=lambda path: int(path.stem), default=None)
