"""``spikeport board write IMAGE``: the files that build and load a board with soft cores."""

from pathlib import Path

import typer

from spikeport.atomic import atomic_path, write_text
from spikeport.backends.softcore import port
from spikeport.backends.softcore.chip import outputs_of
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.memory import MemoryImage
from spikeport.backends.softcore.writer import refuse, soft_chip_of, written
from spikeport.commands.destinations import Destinations
from spikeport.compile.check.verify import verify
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.soft_rows import WORD_BITS
from spikeport.compile.image.usage import core_uses
from spikeport.constants import BITS_PER_KIB
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel, SoftMemory
from spikeport.hardware_models.limits import CoreUse


def run(path: Path, out: Path, *, chip: str | None = None) -> None:
    """Write the parameters of the Verilog and the bytes that load it; print sizes and digest.

    Parameters
    ----------
    path, out : Path
        The image, and the folder that is written.
    chip : str, optional
        The chip; by default that of `soft_chip_of`.

    Raises
    ------
    UsageError
        If the chip is not known, has no soft cores or several FPGAs, or the folder cannot be
        written.
    ImageError
        If the file is not an image.
    BackendError
        If the chip cannot hold the image.
    """
    to = Destinations(out=out, json=None)
    to.check()
    image = ChipImage.load(path)
    model, pool = _soft_chip(image, chip)
    memory = written(image)
    outputs = [one for ports in outputs_of(image) for one in ports]
    broken = [str(one) for one in verify(_uses(image, memory, model), model)]
    if len(outputs) > (most := pool.outputs.count):
        broken.append(f"outputs: {len(outputs):,}, limit {most:,}; cure: probe fewer neurons")
    refuse(broken)
    loading = port.loading(memory, outputs)
    with to.alone():
        write_text(out / "parameters.vh", parameters(memory, len(outputs), pool))
        with atomic_path(out / "load.bin") as new:
            new.write_bytes(loading)
    for name, core in zip(image.cores, memory.cores, strict=True):
        typer.echo(
            f"{name}: {len(core.constants):,} compartments, {len(core.axons):,} output axons, "
            f"{WORD_BITS * len(core.rows) / BITS_PER_KIB:.1f} KiB of rows"
        )
    typer.echo(f"chip {model.name}")
    typer.echo(f"memory image {memory.digest[:16]} of image {image.digest[:16]}")
    typer.echo(f"written: {out}/ (parameters.vh, load.bin: {len(loading):,} bytes)")


def _uses(image: ChipImage, memory: MemoryImage, model: ChipModel) -> list[CoreUse]:
    """Return what each core takes: of axons and rows, what was written for it.

    Weights of more than 8 bits take several rows and axons, which a count of an image's axons does
    not see.
    """
    return [
        use._replace(out_axons=len(core.axons), synapse_bits=WORD_BITS * len(core.rows))
        for use, core in zip(core_uses(image, model), memory.cores, strict=True)
    ]


def _soft_chip(image: ChipImage, chip: str | None) -> tuple[ChipModel, SoftMemory]:
    """Return the model of the chip that is written, and the memory that its soft cores share."""
    model = chips.get(soft_chip_of(image) if chip is None else chip)
    if model.soft_memory is None:
        soft = [name for name in chips.names() if chips.get(name).soft_memory]
        raise UsageError(
            f"chip '{model.name}' has no soft cores; those that have them: {', '.join(soft)}"
        )
    if (n := model.limits.chips.count) > 1:
        raise UsageError(
            f"chip '{model.name}': limits.chips is {n}, but the files are those of one FPGA, limit "
            "1; write an image for one chip, on a larger FPGA if it does not fit"
        )
    return model, model.soft_memory
