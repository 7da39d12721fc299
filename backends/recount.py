"""Totals of a recorded session at a step for which the record has none.

A host asks for totals at its end, which an interrupted session does not reach. The record has
everything that the board received. So the native chip can repeat the steps, and it counts what the
board counted if its answers equal the board's.
"""

from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.messages import BodyError, Codec
from spikeport.backends.board.record import Record, RecordedStep
from spikeport.backends.step_log import Totals
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError


class _BoardStep(NamedTuple):
    """A step of the board: the message that it received from the host, and its answer."""

    number: int
    sent: bytes
    flags: int
    answer: bytes


def recounted(image: ChipImage, path: Path, n_steps: int) -> Totals:
    """Return the totals after ``n_steps`` steps of a record's host, by stepping the image again.

    Parameters
    ----------
    image : ChipImage
        The image that was recorded.
    path : Path
        The record.
    n_steps : int
        Number of steps of the host; the record has at least as many.

    Raises
    ------
    BackendError
        If the native chip's answers differ from the board's, so that its counts would differ, too.
    """
    from spikeport.backends.native.chip import NativeChip  # loads numba: not before use

    codec = Codec(image)
    with closing(Record(path)) as record:
        chip = NativeChip(image, record.session.seed)
        for step in _board_steps(islice(record.steps(), n_steps)):
            try:
                held = chip.step(*codec.unpack_step(step.sent, step.flags))
                then = codec.unpack_state(step.answer)
            except BodyError as error:
                raise BackendError(f"{path}: step {step.number}: {error}") from None
            same = (np.array_equal(*pair) for pair in zip(held, then.held, strict=True))
            if not all(same) or not np.array_equal(chip.log.last, then.counts):
                raise BackendError(
                    f"{path}: the record has no counts after step {n_steps:,}, and the native chip "
                    f"cannot recount them: its answer to step {step.number:,} differs from the "
                    "board's; cure: record a session that is not interrupted, and replay it to its "
                    "end"
                )
    return chip.log.totals()


def _board_steps(steps: Iterator[RecordedStep]) -> Iterator[_BoardStep]:
    """Yield the steps that the board answered: it received no spikes of steps while it was late."""
    opened: RecordedStep | None = None
    for number, step in enumerate(steps, start=1):
        opened = opened or step
        if step.answer is not None:
            yield _BoardStep(number, opened.sent, opened.flags, step.answer)
            opened = None
