"""Network -> passes -> blocks -> passes -> image -> passes -> verified, with a report."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import nengo
from nengo.base import NengoObject

from spikeport.compile.check.hints import image_hints, network_hints
from spikeport.compile.check.lint import lint
from spikeport.compile.check.verify import verify, verify_settings
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import ArgumentError, collected_warnings, without_addresses
from spikeport.compile.ground.rewrite import Built, Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.usage import core_uses
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.extract import extract
from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.pipeline import Observer, PassRun, Pipeline, observe_nothing
from spikeport.compile.placing.load import block_loads, capacity
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.report.neurobench import neurobench
from spikeport.compile.report.report import Report
from spikeport.compile.rewriting.slices import whole_targets
from spikeport.constants import DT_S
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.limits import CoreUse

if TYPE_CHECKING:
    from nengo_loihi.builder import Model


@dataclass(frozen=True)
class Compilation:
    """A compiled network: the image, the report on it, and the blocks it was made of.

    ``stand_ins`` and ``built`` are those of `spikeport.compile.ground.rewrite.Rewrite`.
    """

    image: ChipImage
    report: Report
    blocks: IntegerBlocks
    stand_ins: Mapping[nengo.Probe, nengo.Probe] = field(default_factory=dict)
    built: Mapping[NengoObject, Built] = field(default_factory=dict)

    @property
    def model(self) -> "Model":
        """nengo-loihi's model, which has the host's side."""
        return self.blocks.model


def compile_network(
    network: nengo.Network,
    chip: str | Path = "loihi",
    dt: float = DT_S,
    pipeline: Pipeline | str | None = None,
    observer: Observer = observe_nothing,
) -> Compilation:
    """Compile a network for a chip.

    Parameters
    ----------
    network : nengo.Network
        The network; a seed of 0 stands in where it has none.
    chip : str or Path
        A chip's name, or the path of its TOML file.
    dt : float
        The time step, in seconds.
    pipeline : Pipeline or str, optional
        The passes, or a text that `spikeport.compile.passes.parse` reads; by default the chip's.
        Without any pass every block has a core of its own, as in nengo-loihi.
    observer : callable
        Called after every pass with the pass and the value it left.

    Raises
    ------
    DoesNotFitError
        With every rule the network breaks, and every limit of the chip it exceeds.
    CompileError
        If nengo-loihi's builder refuses it for another reason.
    UsageError, ChipFileError
        If an argument is not valid, chip or passes are not known, or the chip's file is wrong.
    """
    check_arguments(network, chip, dt, pipeline)
    target = chips.get(str(chip))
    passes = target.pipeline if pipeline is None else pipeline
    run = PassRun(parse(passes) if isinstance(passes, str) else passes, target, dt, observer)
    names = Names(network)
    rewrite, said = _rewritten(network, names, run, target.name)
    floats = run.blocks(build(rewrite, dt))
    blocks = discretise(floats)
    unplaced = extract(blocks, target.name)
    image = run.images(unplaced)
    cores = _verified(image, target)
    report = Report(
        target,
        image.digest,
        tuple(cores),
        blocks.errors,
        tuple(sorted({*blocks.warnings, *said})),
        placed=_placed(image),
        passes=tuple(run.record),
        lower_bound=lower_bound(block_loads(image, target), capacity(target)),
        neurobench=neurobench(image, cores),
        hints=(*network_hints(network, names), *image_hints(unplaced, blocks.errors)),
    )
    return Compilation(image, report, blocks, rewrite.stand_ins, rewrite.built)


def check_arguments(network: object, chip: object, dt: object, pipeline: object) -> None:
    """Raise `ArgumentError` if an argument of `compile_network` is not valid."""
    if not isinstance(network, nengo.Network):
        raise ArgumentError("network", network, "a nengo.Network")
    if not isinstance(chip, str | Path):
        raise ArgumentError("chip", chip, "the name of a chip, or the path of its TOML file")
    if not isinstance(dt, Real) or not 0 < _as_float(dt) < math.inf:
        raise ArgumentError("dt", dt, "a time step in seconds, above 0 and finite")
    if pipeline is not None and not isinstance(pipeline, str | Pipeline):
        raise ArgumentError("pipeline", pipeline, "a Pipeline, its text, or None for the chip's")


def _as_float(number: Real) -> float:
    """Return a number as a float; infinity if it is an integer beyond all floats."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _rewritten(
    network: nengo.Network, names: Names, run: PassRun, chip: str
) -> tuple[Rewrite, list[str]]:
    """Return the rewritten network, and warnings on the way; rules hold before and after."""
    if broken := lint(network, names, rewritten=not run.rewrites):
        raise DoesNotFitError(chip, broken)
    with collected_warnings() as said:
        rewrite = whole_targets(run.networks(Rewrite(network, names)), run.dt_s)
    if broken := lint(rewrite.network, rewrite.names):
        raise DoesNotFitError(chip, broken)
    return rewrite, [without_addresses(one.message) for one in said]


def _verified(image: ChipImage, target: ChipModel) -> list[CoreUse]:
    """Return the use of every core, once all limits of the chip are found to be kept."""
    cores = core_uses(image, target)
    if exceeded := [*verify(cores, target), *verify_settings(image, target)]:
        raise DoesNotFitError(target.name, exceeded)
    return cores


def _placed(image: ChipImage) -> tuple[tuple[str, ...], ...]:
    """Return the blocks on each core, as nengo-loihi built them."""
    names: list[list[str]] = [[] for _ in range(image.n_cores)]
    for core, block in zip(image.blocks.core, image.manifest.blocks, strict=True):
        names[core].append(block.built)
    return tuple(tuple(dict.fromkeys(mine)) for mine in names)
