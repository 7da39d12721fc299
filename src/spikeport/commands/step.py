"""``spikeport step IMAGE``: runs an image by itself, without the network it was made from."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import typer

from spikeport.atomic import check_output
from spikeport.backends.decoding import Output
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.counted import counted
from spikeport.errors import UsageError
from spikeport.files import write_arrays
from spikeport.hardware_models.activity import PER_RUN, PER_STEP, Activity
from spikeport.reading import npz
from spikeport.reading.mismatch import MismatchError

WANTED = ("steps", "sources")
STEP_BYTES = 200
"""Memory of a step besides its values, in bytes: an array of spikes, and entries of lists."""
MOST_BYTES = 2**32
FORMAT = (
    "give an npz with two arrays of integers of the same length: in step steps[i], from 0, "
    "sources[i] spikes, counted through all inputs as `spikeport show` lists them"
)


def run(image: Path, *, spikes: Path | None, n_steps: int, out: Path, seed: int) -> None:
    """Step an image, and write its outputs and activity."""
    check_output("--out", out, image, *([spikes] if spikes else []))
    loaded = ChipImage.load(image)
    _check_size(loaded, n_steps)
    sent = by_step(loaded, spikes, n_steps)
    found = stepped(loaded, sent, seed)
    _write(out, loaded, sent, found)
    total = found.activity.totals()
    typer.echo(
        f"{counted(n_steps, 'step')} of image {loaded.digest[:12]}: "
        f"{counted(total['spikes'], 'spike')}, "
        f"{counted(total['synaptic_operations'], 'synaptic operation')}; written: {out}"
    )


def _check_size(image: ChipImage, n_steps: int) -> None:
    """Refuse steps whose outputs and bookkeeping would fill the memory."""
    values = sum(entry.size for entry in image.manifest.outputs)
    counts = len(PER_STEP) * image.n_cores
    needed = n_steps * (STEP_BYTES + 4 * len(image.reads) + 8 * (values + counts))
    if needed > MOST_BYTES:
        most = MOST_BYTES * n_steps // needed
        raise UsageError(
            f"--steps {n_steps}: the outputs and counts of these steps take {needed:,} bytes, "
            f"limit {MOST_BYTES:,}; ask for at most {most:,} steps of this image"
        )


class Stepped(NamedTuple):
    """The values that each output held, (n_steps, n) each, and the counts.

    ``counts`` (n_steps, 6, n_cores) are the counts of every step, in the order of `PER_STEP`; the
    activity of a long run has only its last steps one by one.
    """

    held: list[np.ndarray]
    counts: np.ndarray
    activity: Activity


def stepped(image: ChipImage, sent: list[np.ndarray], seed: int) -> Stepped:
    """Run an image with the sources that spike in each step."""
    chip = NativeChip(image, seed)
    counts = np.zeros((len(sent), len(PER_STEP), image.n_cores), dtype=np.int64)
    sizes = np.diff(image.outputs.start)
    held = [np.zeros((len(sent), size), dtype=np.int32) for size in sizes]
    for number, sources in enumerate(sent):
        # Without error signals: the host's side of a learning rule is not in the image.
        for rows, output in zip(held, chip.step(sources, {}), strict=True):
            rows[number] = output
        counts[number] = chip.log.last
    return Stepped(held, counts, chip.activity())


def by_step(image: ChipImage, path: Path | None, n_steps: int) -> list[np.ndarray]:
    """Return the sources that spike in each step.

    Raises
    ------
    UsageError
        If the file has another format, or a spike has no such source or step, or occurs twice.
    """
    step, source = (np.zeros(0, dtype=np.int64),) * 2 if path is None else _read(path)
    for name, numbers, end, kind in (
        ("steps", step, n_steps, f"the run has {n_steps} steps"),
        ("sources", source, image.n_inputs, f"the image has {image.n_inputs} sources"),
    ):
        wrong = np.flatnonzero((numbers < 0) | (numbers >= end))
        if wrong.size:
            raise UsageError(
                f"{path}: {name}[{wrong[0]}] is {numbers[wrong[0]]}, but {kind}, counted from 0"
            )
    # Sorted, so that spikes that occur twice are adjacent.
    order = np.lexsort((source, step))
    step, source = step[order], source[order]
    twice = np.flatnonzero((np.diff(step) == 0) & (np.diff(source) == 0))
    if twice.size:
        first = twice[0]
        raise UsageError(
            f"{path}: source {source[first]} spikes twice in step {step[first]}; a source spikes "
            "once in a step"
        )
    return np.split(source, np.searchsorted(step, np.arange(1, n_steps)))


def _read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    try:
        found = npz.read(path)
    except MismatchError as error:
        raise UsageError(f"{path}: not a file of spikes: {error}; {FORMAT}") from None
    if not set(WANTED) <= set(found):
        raise UsageError(f"{path}: not a file of spikes; {FORMAT}")
    arrays = [found[name] for name in WANTED]
    if any(a.ndim != 1 or a.dtype.kind not in "iu" or len(a) != len(arrays[0]) for a in arrays):
        raise UsageError(f"{path}: not a file of spikes; {FORMAT}")
    step, source = (array.clip(max=np.iinfo(np.int64).max).astype(np.int64) for array in arrays)
    return step, source


def _write(out: Path, image: ChipImage, sent: list[np.ndarray], run: Stepped) -> None:
    members: dict[str, np.ndarray] = {
        "image_digest": np.array(image.digest),
        "dt_s": np.array(image.manifest.dt_s),
        "names": np.array([entry.name for entry in image.manifest.outputs], dtype=np.str_),
    }
    for number, rows in enumerate(run.held):
        output = Output(image, number)
        values = [np.ravel(output.decode(row)) for row in rows]
        members[f"held_{number}"] = rows
        members[f"values_{number}"] = np.array(values).reshape(len(rows), output.size)
    for number, name in enumerate(PER_STEP):
        members[f"activity_{name}"] = run.counts[:, number]
    members["activity_host_spikes"] = np.array([len(sources) for sources in sent])
    for name in (*PER_RUN, "readout_spikes"):
        members[f"activity_{name}"] = np.asarray(getattr(run.activity, name))
    write_arrays(out, members)
