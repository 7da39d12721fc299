"""Network -> lint -> blocks -> placement -> image -> verified, with a report."""

from dataclasses import dataclass
from pathlib import Path

import nengo
from nengo_loihi.builder import Model

from spikeport.compile.build import build
from spikeport.compile.extract import extract
from spikeport.compile.image import ChipImage
from spikeport.compile.lint import lint
from spikeport.compile.names import Names
from spikeport.compile.place import place
from spikeport.compile.report import Report
from spikeport.compile.usage import core_uses
from spikeport.compile.verify import verify
from spikeport.compile.violation import DoesNotFitError
from spikeport.hardware_models import chip as chips


@dataclass(frozen=True)
class Compilation:
    """A compiled network: the image, what it takes, and nengo-loihi's model for the host side."""

    image: ChipImage
    report: Report
    model: Model


def compile_network(
    network: nengo.Network, chip: str | Path = "loihi", dt: float = 0.001
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
    names = Names(network)
    if broken := lint(network, names):
        raise DoesNotFitError(target.name, broken)
    blocks = build(network, names, dt)
    image = extract(blocks, place(blocks), target.name)
    cores = core_uses(image)
    if exceeded := verify(cores, target):
        raise DoesNotFitError(target.name, exceeded)
    report = Report(target, image.digest, tuple(cores), blocks.errors, blocks.warnings)
    return Compilation(image, report, blocks.model)
