"""``spikeport export IMAGE --nir FILE``."""

from pathlib import Path

import typer

from spikeport.atomic import check_output
from spikeport.compile.image.chip_image import ChipImage
from spikeport.nir_export import export


def run(image: Path, nir: Path) -> None:
    """Write a chip image as a NIR graph, and print its size."""
    check_output("--nir", nir, image)
    loaded = ChipImage.load(image)
    export(loaded, nir)
    typer.echo(
        f"image {loaded.digest[:12]}: {loaded.n_compartments:,} neurons in {loaded.n_blocks:,} "
        f"nodes, in steps of {loaded.manifest.dt_s:g} s; written: {nir}"
    )
