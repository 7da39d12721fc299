"""``spikeport export IMAGE --nir FILE``."""

from pathlib import Path

import typer

from spikeport.atomic import check_output
from spikeport.compile.image.chip_image import ChipImage
from spikeport.counted import counted
from spikeport.nir_export import export


def run(image: Path, nir: Path) -> None:
    """Write a chip image as a NIR graph, and print its size."""
    check_output("--nir", nir, image)
    loaded = ChipImage.load(image)
    export(loaded, nir)
    typer.echo(
        f"image {loaded.digest[:12]}: {counted(loaded.n_compartments, 'neuron')} in "
        f"{counted(loaded.n_blocks, 'node')}, in steps of {loaded.manifest.dt_s:g} s; "
        f"written: {nir}"
    )
