"""Network -> passes -> blocks -> passes -> image -> passes -> verified, with a report."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nengo
from nengo_loihi.builder import Model

from spikeport.compile.build import build
from spikeport.compile.extract import extract
from spikeport.compile.image import ChipImage
from spikeport.compile.lint import lint
from spikeport.compile.names import Names
from spikeport.compile.passes.base import BlockPass, ImagePass, NetworkPass
from spikeport.compile.passes.pipeline import Observer, PassRun, Pipeline, silent
from spikeport.compile.report import Report
from spikeport.compile.rewrite import Rewrite
from spikeport.compile.usage import core_uses
from spikeport.compile.verify import verify
from spikeport.compile.violation import DoesNotFitError
from spikeport.hardware_models import chip as chips


@dataclass(frozen=True)
class Compilation:
    """A compiled network: the image, what it takes, and nengo-loihi's model for the host side.

    ``stand_ins`` and ``built`` are those of `spikeport.compile.rewrite.Rewrite`.
    """

    image: ChipImage
    report: Report
    model: Model
    stand_ins: Mapping[nengo.Probe, nengo.Probe] = field(default_factory=dict)
    built: Mapping[Any, Any] = field(default_factory=dict)


def compile_network(
    network: nengo.Network,
    chip: str | Path = "loihi",
    dt: float = 0.001,
    pipeline: Pipeline | None = None,
    observer: Observer = silent,
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
    pipeline : Pipeline, optional
        The passes; by default no pass: one block a core, as nengo-loihi does.
    observer : callable
        Called after every pass with the pass and the value it left.

    Raises
    ------
    DoesNotFitError
        With every rule the network breaks, and every limit of the chip it exceeds.
    CompileError
        If nengo-loihi's builder refuses it for another reason.
    UsageError, ChipFileError
        If the chip is not known, or its file is wrong.
    """
    target = chips.get(str(chip))
    run = PassRun(pipeline or Pipeline(()), target, dt, observer)
    rewrite = run.apply(NetworkPass, Rewrite(network, Names(network)))
    if broken := lint(rewrite.network, rewrite.names):
        raise DoesNotFitError(target.name, broken)
    blocks = build(rewrite.network, rewrite.names, dt, lambda model: run.apply(BlockPass, model))
    image = run.apply(ImagePass, extract(blocks, target.name))
    cores = core_uses(image)
    if exceeded := verify(cores, target):
        raise DoesNotFitError(target.name, exceeded)
    report = Report(target, image.digest, tuple(cores), blocks.errors, blocks.warnings)
    return Compilation(image, report, blocks.model, rewrite.stand_ins, rewrite.built)
