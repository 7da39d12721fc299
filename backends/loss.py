"""Measurement of the loss to rounding: see `spikeport.compile.report.loss`.

The network runs once on its image, in closed loop with its host. The host's spikes are then sent
again to the blocks in floating point: first with no number rounded, then with one part of the
numbers rounded at a time.
"""

import contextlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import nengo
import numpy as np

from spikeport.backends.against_float import error_against_float
from spikeport.backends.attempt import attempt
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.recorder import Recorder
from spikeport.backends.rerun import TAU_S, Rerun, check
from spikeport.backends.step_log import LogOptions
from spikeport.compile.check.lost_values import readout_hints
from spikeport.compile.ground.quantisation import relative_rms
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.modules import by_module
from spikeport.compile.image.tables import part
from spikeport.compile.loihi.aliasing import rate_aliasing
from spikeport.compile.loihi.extract import extract
from spikeport.compile.loihi.numbers import Numbers, restored, wanted
from spikeport.compile.pipeline import Compilation
from spikeport.compile.report.loss import Loss, LossPart
from spikeport.errors import BackendError
from spikeport.fresh_copy import fresh_copy
from spikeport.hardware_models.activity import Activity
from spikeport.progress import Progress

# A relative change far below any rounding: its error is the floor of the measurement.
LAST_BIT = 1 + 2.0**-40
NEURONS = {
    "bias": "bias",
    "threshold": "vth",
    "current decay": "decay_u",
    "voltage decay": "decay_v",
}


class MeasuredLoss(NamedTuple):
    """A loss, and the counts of the run it was measured in, by core and by module."""

    loss: Loss
    activity: Activity
    by_module: Activity


class Cause(NamedTuple):
    """A part of an array of `Numbers` that the discretiser rounded."""

    object: str
    what: str
    array: str
    part: slice

    def rounding(self, exact: Numbers, rounded: Numbers) -> float:
        """Return the relative rms error of the part."""
        pair = (getattr(numbers, self.array)[self.part] for numbers in (rounded, exact))
        return relative_rms(*pair)


def measure(
    network: nengo.Network,
    compilation: Compilation,
    seconds: float,
    seed: int,
    progress: Progress,
) -> MeasuredLoss:
    """Measure the loss of a compiled network: run its image, and its blocks in floating point.

    Parameters
    ----------
    network : nengo.Network
        The network as the user wrote it; a copy of it runs in float Nengo.
    compilation : Compilation
        The compiled network.
    seconds : float
        Simulated time of each run, in s.
    seed : int
        Seed of processes on the host.
    progress : callable
        See `spikeport.progress.Progress`.

    Raises
    ------
    BackendError
        If blocks learn or have noise, nothing is read out, outputs are 0 in floating point,
        or a function of the network fails.
    """
    blocks = compilation.blocks
    image = extract(blocks, compilation.image.manifest.chip)
    check(image)  # before a run that may take minutes
    progress("running the network", None)
    spikes, activity, against_float = _run(network, compilation, seconds, seed)
    rerun, exact = Rerun(image, spikes), wanted(blocks)
    baseline, rounded = rerun.floats(exact), rerun.integers()
    _check_baseline(baseline, rounded, activity)
    loss = Loss(
        n_steps=len(spikes),
        tau_s=TAU_S,
        network_error=against_float,
        output_error=relative_rms(rounded, baseline),
        floor=relative_rms(rerun.floats(replace(exact, bias=exact.bias * LAST_BIT)), baseline),
        parts=_parts(rerun, exact, restored(blocks), baseline, list(causes(image)), progress),
        aliasing=rate_aliasing(blocks.floats),
        readout_spikes=activity.readout_spikes,
        saturated_inputs=activity.saturated_inputs,
    )
    return MeasuredLoss(loss, activity, _counts(by_module(compilation.image), spikes))


def _check_baseline(baseline: np.ndarray, rounded: np.ndarray, run: Activity) -> None:
    """Refuse outputs whose error would be relative to zero."""
    if baseline.any():
        return
    chip = "but not on the chip" if rounded.any() else "and on the chip"
    saturated = map(str, readout_hints(run.readout_spikes, run.n_steps))
    why = next(saturated, "measure a longer time, or give the network an input")
    raise BackendError(
        f"cannot measure the loss: the outputs are 0 in floating point, {chip}, and no error is "
        f"relative to 0; {why}"
    )


def _counts(image: ChipImage, spikes: Sequence[np.ndarray]) -> Activity:
    """Return the counts of an image that runs again on the recorded spikes of its host."""
    chip = NativeChip(image, seed=0)
    for step in spikes:
        chip.step(step, {})
    return chip.activity()


def network_error(
    network: nengo.Network, compilation: Compilation, seconds: float, seed: int
) -> float | None:
    """Return the error of a compiled network's probes against float Nengo; see `measure`."""
    return _run(network, compilation, seconds, seed)[2]


def _run(
    network: nengo.Network, compilation: Compilation, seconds: float, seed: int
) -> tuple[list[np.ndarray], Activity, float | None]:
    """Run on the image; return the host's spikes, the counts, and the error against float Nengo."""
    n_steps = max(1, round(seconds / compilation.image.manifest.dt_s))
    copy = fresh_copy(network)
    chip = NativeChip(compilation.image, seed, LogOptions(compilation.report.chip))
    recorder = Recorder(chip)
    loop = attempt("before step 1", lambda: HostLoop(compilation, recorder, seed))
    with contextlib.closing(loop):
        for step in range(n_steps):
            attempt(f"step {step + 1}", loop.step)
        found = error_against_float(network, copy, loop, n_steps, seed)
        return recorder.spikes, loop.activity(), found


def causes(image: ChipImage) -> Iterator[Cause]:
    """Yield each part that is rounded: weights of a connection, or neurons of a block."""
    labels = [block.label for block in image.manifest.blocks]
    taken = Counter[tuple[str, str]]()
    for group, block in enumerate(image.groups.block):
        what = f"weights from {_senders(image, group, labels)}"
        taken[labels[block], what] += 1
        if (number := taken[labels[block], what]) > 1:
            what += f" ({number})"  # causes of one name would be one to a reader of the report
        yield Cause(labels[block], what, "weights", part(image.synapse_start, group))
    for block, label in enumerate(labels):
        mine = part(image.blocks.start, block)
        for what, array in NEURONS.items():
            yield Cause(label, what, array, mine)


def _senders(image: ChipImage, group: int, labels: list[str]) -> str:
    """Return the senders of the spikes that a synapse group receives."""
    routes = np.flatnonzero(image.routes.group == group)
    sources = zip(image.routes.from_input[routes], image.routes.source[routes], strict=True)
    return ", ".join(dict.fromkeys("the host" if host else labels[i] for host, i in sources))


def _parts(
    rerun: Rerun,
    exact: Numbers,
    rounded: Numbers,
    baseline: np.ndarray,
    found: Sequence[Cause],
    progress: Progress,
) -> tuple[LossPart, ...]:
    """Return the output error of each cause alone, largest first."""
    errors = []
    found = [cause for cause in found if cause.rounding(exact, rounded) > 0]
    for i, cause in enumerate(found):
        progress("rounding one part at a time", i / len(found))
        mixed = exact.with_part(cause.array, rounded, cause.part)
        errors.append(relative_rms(rerun.floats(mixed), baseline))
    # The squares of independent errors add up, so shares are of the sum of squares.
    squares = sum(one**2 for one in errors) or 1.0
    parts = [
        LossPart(cause.object, cause.what, cause.rounding(exact, rounded), one, one**2 / squares)
        for cause, one in zip(found, errors, strict=True)
    ]
    return tuple(sorted(parts, key=lambda part: -part.share))
