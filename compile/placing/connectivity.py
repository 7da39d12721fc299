"""The wiring of an image, divided into groups and routes and put together again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import BlockEntry
from spikeport.compile.image.tables import (
    BLOCK_SETTINGS,
    Blocks,
    Groups,
    InAxons,
    OutAxons,
    Routes,
    Rows,
    RowTables,
    Synapses,
    flat,
    offsets,
    part,
)


@dataclass(frozen=True)
class SpikeRows:
    """The rows of weights of a group, end to end: row i is ``start[i]`` to ``start[i + 1]``.

    ``atoms`` and ``start`` are as in `Rows`; a row lists its weights and targets atom by atom.
    """

    atoms: np.ndarray
    start: np.ndarray
    weights: np.ndarray
    indices: np.ndarray

    def __len__(self) -> int:
        return len(self.atoms)

    @property
    def sizes(self) -> np.ndarray:
        """The number of synapses of each row, all atoms together."""
        return np.diff(self.start)


class Group(NamedTuple):
    """A synapse group: rows of weights, and the input axons that read them.

    ``like`` is the group of the image whose format, learning, type and label this group has;
    ``block`` is the block it belongs to; ``axon_row`` and ``axon_base`` hold row and base of its
    axons.
    """

    like: int
    block: int
    rows: SpikeRows
    axon_row: np.ndarray
    axon_base: np.ndarray


class Route(NamedTuple):
    """Output axons of a block or an input to one group: axon, or -1, and atom of each source."""

    of_input: bool
    source: int
    group: int
    axon: np.ndarray
    atom: np.ndarray


@dataclass(frozen=True)
class Division:
    """A division of an image's compartments into blocks.

    ``start`` and ``core`` are as in the image; ``like`` is, for each block, the block of the image
    whose settings it has; ``entries`` are the blocks' entries in the manifest.
    """

    start: np.ndarray
    core: np.ndarray
    like: np.ndarray
    entries: tuple[BlockEntry, ...]


def groups_of(image: ChipImage) -> list[Group]:
    """Return the synapse groups of an image."""
    return [_group(image, number) for number in range(len(image.groups))]


def routes_of(image: ChipImage) -> list[Route]:
    """Return the routes of an image."""
    routes, axons = image.routes, image.out_axons
    heads = zip(
        routes.from_input.astype(bool).tolist(),
        routes.source.tolist(),
        routes.group.tolist(),
        strict=True,
    )
    parts = [part(routes.start, number) for number in range(len(routes))]
    return [
        Route(*head, axons.axon[mine], axons.atom[mine])
        for head, mine in zip(heads, parts, strict=True)
    ]


def division_of(image: ChipImage) -> Division:
    """Return the blocks of an image."""
    blocks = image.blocks
    return Division(blocks.start, blocks.core, np.arange(image.n_blocks), image.manifest.blocks)


def assemble(
    image: ChipImage, division: Division, groups: Sequence[Group], routes: Sequence[Route]
) -> ChipImage:
    """Return the image with other blocks, groups and routes; all else stays."""
    labels = image.manifest.groups
    manifest = replace(
        image.manifest,
        blocks=division.entries,
        groups=tuple(labels[group.like] for group in groups),
    )
    return replace(
        image,
        manifest=manifest,
        blocks=_blocks(image, division),
        groups=_groups(image, groups),
        in_axons=InAxons(
            row=flat([group.axon_row for group in groups]),
            base=flat([group.axon_base for group in groups]),
        ),
        **_rows([group.rows for group in groups]),
        routes=Routes(
            from_input=np.array([route.of_input for route in routes], dtype=int),
            source=np.array([route.source for route in routes], dtype=int),
            group=np.array([route.group for route in routes], dtype=int),
            start=offsets(len(route.axon) for route in routes),
        ),
        out_axons=OutAxons(
            axon=flat([route.axon for route in routes]),
            atom=flat([route.atom for route in routes]),
        ),
    )


def _group(image: ChipImage, number: int) -> Group:
    axons = part(image.groups.axon_start, number)
    return Group(
        number,
        int(image.groups.block[number]),
        _rows_of(image, part(image.groups.row_start, number)),
        image.in_axons.row[axons],
        image.in_axons.base[axons],
    )


def _rows_of(image: ChipImage, mine: slice) -> SpikeRows:
    start = image.rows.start[mine.start : mine.stop + 1]
    entries = slice(start[0], start[-1])
    return SpikeRows(
        image.rows.atoms[mine],
        start - start[0],
        image.synapses.weight[entries],
        image.synapses.index[entries],
    )


def _blocks(image: ChipImage, division: Division) -> Blocks:
    """Return the table of blocks: each has the settings of the block it is like."""
    settings = {name: getattr(image.blocks, name)[division.like] for name in BLOCK_SETTINGS}
    return Blocks(start=division.start, core=division.core, **settings)


def _groups(image: ChipImage, groups: Sequence[Group]) -> Groups:
    like = np.array([group.like for group in groups], dtype=int)
    return Groups(
        block=np.array([group.block for group in groups], dtype=int),
        pop_type=image.groups.pop_type[like],
        format=image.groups.format[like],
        learning=image.groups.learning[like],
        axon_start=offsets(len(group.axon_row) for group in groups),
        row_start=offsets(len(group.rows) for group in groups),
    )


def _rows(groups: Sequence[SpikeRows]) -> RowTables:
    return {
        "rows": Rows(
            atoms=flat([rows.atoms for rows in groups]),
            start=offsets(flat([rows.sizes for rows in groups])),
        ),
        "synapses": Synapses(
            weight=flat([rows.weights for rows in groups]),
            index=flat([rows.indices for rows in groups]),
        ),
    }
