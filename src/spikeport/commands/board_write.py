"""``spikeport board write IMAGE``: what a board with soft cores is built of, and loaded with."""

from pathlib import Path

import typer

from spikeport.atomic import write_text
from spikeport.backends.softcore import stream
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.verilated import FOLDER
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.soft_rows import WORD_BITS


def run(path: Path, out: Path, *, baud_cycles: int, log_queue: int) -> None:
    """Write the parameters of the Verilog and the bytes that load it; print sizes and digest."""
    image = ChipImage.load(path)
    memory = written(image)
    loading = stream.loading(memory)
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "parameters.vh", parameters(memory, baud_cycles, log_queue))
    (out / "load.bin").write_bytes(loading)
    for name, core in zip(image.cores, memory.cores, strict=True):
        typer.echo(
            f"{name}: {len(core.constants):,} compartments, {len(core.axons):,} output axons, "
            f"{WORD_BITS * len(core.rows) / 8192:.1f} KiB of rows"
        )
    typer.echo(f"memory image {memory.digest[:16]} of image {image.digest[:16]}")
    typer.echo(f"written: {out}/ (parameters.vh, load.bin: {len(loading):,} bytes)")
    typer.echo(f"Verilog: {FOLDER}")
