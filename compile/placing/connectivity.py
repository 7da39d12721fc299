"""The wiring of an image taken apart into groups and routes, and put together again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from spikeport.compile.extract import flat, offsets
from spikeport.compile.image import ChipImage


class Row(NamedTuple):
    """Weights and targets of one spike, each (n_atoms, n)."""

    weights: np.ndarray
    indices: np.ndarray


class Group(NamedTuple):
    """A synapse group: rows of weights, and the input axons that read them.

    ``like`` is a group of the image whose format, learning, type and label it has; ``block`` the
    block it belongs to; ``axon_row`` and ``axon_base`` are those of its axons.
    """

    like: int
    block: int
    rows: Sequence[Row]
    axon_row: np.ndarray
    axon_base: np.ndarray


class Route(NamedTuple):
    """Output axons of a block or an input to one group: the axon, or -1, and atom of each."""

    of_input: bool
    source: int
    group: int
    axon: np.ndarray
    atom: np.ndarray


@dataclass(frozen=True)
class Blocks:
    """How an image's compartments are divided into blocks.

    ``start`` and ``core`` are as in the image; ``like`` is the block of the image each has the
    settings of; ``entries`` are those of the manifest.
    """

    start: np.ndarray
    core: np.ndarray
    like: np.ndarray
    entries: list[dict[str, Any]] = field(default_factory=list)


def groups_of(image: ChipImage) -> list[Group]:
    """The synapse groups of an image."""
    return [_group(image, number) for number in range(len(image["synapse_block"]))]


def routes_of(image: ChipImage) -> list[Route]:
    """The routes of an image."""
    parts = [image.part("route_start", number) for number in range(len(image["route_input"]))]
    return [
        Route(
            bool(image["route_input"][number]),
            int(image["route_source"][number]),
            int(image["route_synapse"][number]),
            image["route_axon"][part],
            image["route_atom"][part],
        )
        for number, part in enumerate(parts)
    ]


def blocks_of(image: ChipImage) -> Blocks:
    """The blocks of an image."""
    numbers = np.arange(image.n_blocks)
    return Blocks(image["block_start"], image["block_core"], numbers, image.manifest["blocks"])


def assemble(
    image: ChipImage, blocks: Blocks, groups: Sequence[Group], routes: Sequence[Route]
) -> ChipImage:
    """The image with other blocks, groups and routes; compartments, inputs and outputs stay."""
    labels = image.manifest["synapses"]
    manifest = {
        **image.manifest,
        "blocks": blocks.entries,
        "synapses": [labels[group.like] for group in groups],
    }
    changed = {**_blocks(image, blocks), **_groups(image, groups), **_routes(routes)}
    return ChipImage(manifest, {**image.arrays, **changed})


def _group(image: ChipImage, number: int) -> Group:
    rows, axons = image.part("row_start", number), image.part("in_axon_start", number)
    return Group(
        number,
        int(image["synapse_block"][number]),
        [_row(image, row) for row in range(rows.start, rows.stop)],
        image["in_axon_row"][axons],
        image["in_axon_base"][axons],
    )


def _row(image: ChipImage, number: int) -> Row:
    part, atoms = image.part("row_weight_start", number), image["row_atoms"][number]
    return Row(image["weights"][part].reshape(atoms, -1), image["indices"][part].reshape(atoms, -1))


def _blocks(image: ChipImage, blocks: Blocks) -> dict[str, np.ndarray]:
    names = ("vmin", "vmax", "noise_offset", "noise_exp", "noise_at_membrane")
    settings = {f"block_{name}": image[f"block_{name}"][blocks.like] for name in names}
    return {"block_start": blocks.start, "block_core": blocks.core, **settings}


def _groups(image: ChipImage, groups: Sequence[Group]) -> Mapping[str, np.ndarray]:
    rows = [row for group in groups for row in group.rows]
    like = np.array([group.like for group in groups], dtype=int)
    kept = ("synapse_pop_type", "synapse_format", "synapse_learning")
    return {
        "synapse_block": np.array([group.block for group in groups], dtype=int),
        **{name: image[name][like] for name in kept},
        "in_axon_start": offsets(len(group.axon_row) for group in groups),
        "in_axon_row": flat([group.axon_row for group in groups]),
        "in_axon_base": flat([group.axon_base for group in groups]),
        "row_start": offsets(len(group.rows) for group in groups),
        "row_atoms": np.array([len(row.weights) for row in rows], dtype=int),
        "row_weight_start": offsets(row.weights.size for row in rows),
        "weights": flat([row.weights.ravel() for row in rows]),
        "indices": flat([row.indices.ravel() for row in rows]),
    }


def _routes(routes: Sequence[Route]) -> Mapping[str, np.ndarray]:
    return {
        "route_input": np.array([route.of_input for route in routes], dtype=int),
        "route_source": np.array([route.source for route in routes], dtype=int),
        "route_synapse": np.array([route.group for route in routes], dtype=int),
        "route_start": offsets(len(route.axon) for route in routes),
        "route_axon": flat([route.axon for route in routes]),
        "route_atom": flat([route.atom for route in routes]),
    }
