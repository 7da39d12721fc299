"""``spikeport show IMAGE``: the content of a chip image, as tables."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spikeport.commands.console import Console, ScreenTable
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import Encoding, Filter
from spikeport.counted import counted
from spikeport.errors import printable


def run(path: Path) -> None:
    """Print the content of an image."""
    image = ChipImage.load(path)
    console = Console()
    for line in head(image):
        console.print(printable(line), soft_wrap=True)
    for table in (_blocks(image), _inputs(image), _outputs(image)):
        console.print(table)


def head(image: ChipImage) -> Iterator[str]:
    """Yield the lines on the chip of an image, and on its size."""
    manifest = image.manifest
    yield f"image {image.digest}"
    yield f"for chip {manifest.chip}, computes as {manifest.arithmetic}, schema {manifest.schema}"
    yield (
        f"{counted(image.n_compartments, 'compartment')} in {counted(image.n_blocks, 'block')} on "
        f"{counted(image.n_cores, 'core')}, {counted(len(image.synapses), 'synapse')} in "
        f"{counted(len(image.groups), 'group')} ({image.learns.sum():,} of them learning), steps "
        f"of {1000 * manifest.dt_s:g} ms"
    )


def _table(title: str, *columns: str) -> ScreenTable:
    left = ("block", "name", "kind", "encoding", "filter", "read")
    table = ScreenTable(title=title, title_justify="left", pad_edge=False)
    for name in columns:
        table.add_column(name, justify="left" if name in left else "right")
    return table


def _blocks(image: ChipImage) -> ScreenTable:
    table = _table("blocks", "", "core", "block", "kind", "first", "compartments")
    sizes = np.diff(image.blocks.start)
    for number, entry in enumerate(image.manifest.blocks):
        core, first = image.blocks.core[number], image.blocks.start[number]
        row = (str(number), str(core), printable(entry.label), entry.kind, f"{first:,}")
        table.add_row(*row, f"{sizes[number]:,}")
    return table


def _inputs(image: ChipImage) -> ScreenTable:
    table = _table("inputs", "", "name", "first", "sources", "encoding", "filter")
    first = 0
    for number, entry in enumerate(image.manifest.inputs):
        encoding = _encoding(entry.encoding)
        row = (str(number), printable(entry.name), f"{first:,}", f"{entry.size:,}", encoding)
        table.add_row(*row, _filter(entry.filter))
        first += entry.size
    return table


def _outputs(image: ChipImage) -> ScreenTable:
    table = _table("outputs", "", "name", "read", "compartments", "values", "filter")
    for number, entry in enumerate(image.manifest.outputs):
        row = (str(number), printable(entry.name), entry.key, f"{sum(entry.segments):,}")
        table.add_row(*row, f"{entry.size:,}", _filter(entry.filter))
    return table


def _encoding(encoding: Encoding) -> str:
    if encoding.kind == "spikes":
        return "spikes as they are"
    return f"on/off, {encoding.bias:g} ± {encoding.gain:g} x Hz"


def _filter(found: Filter | None) -> str:
    if found is None:
        return "none"
    tau = "" if found.tau_s is None else f", {1000 * found.tau_s:g} ms"
    return printable(f"{found.kind}{tau}")
