"""Cuts of blocks into pieces: stretches of their compartments, which can lie on different cores.

Every compartment keeps its number, its integers and its input. An input axon of a block becomes one
axon of each piece in which it has targets; the compartments that sent to it send to all of these.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import BlockEntry
from spikeport.compile.image.tables import offsets, ranges
from spikeport.compile.placing.connectivity import (
    Division,
    Group,
    Route,
    SpikeRows,
    assemble,
    groups_of,
    routes_of,
)


class KeptPiece(NamedTuple):
    """A piece of a group: its number, and its axon for each of the group's axons, or -1."""

    group: int
    axon: np.ndarray


def can_cut(image: ChipImage) -> np.ndarray:
    """Return the blocks that can be cut, (n_blocks,): their axons are plain and do not learn."""
    whole = np.zeros(image.n_blocks, dtype=bool)
    # `_stretches` divides rows of one atom only, and the error that a group learns from has the
    # shape of the whole group.
    odd = (image.groups.pop_type != 0) | image.learns
    odd[image.row_group[image.rows.atoms != 1]] = True
    whole[image.groups.block[odd]] = True
    return ~whole


def cut(image: ChipImage, cuts: Mapping[int, Sequence[int]]) -> ChipImage:
    """Cut blocks into pieces; every piece and every other block gets a core of its own.

    Parameters
    ----------
    image : ChipImage
        The image.
    cuts : mapping of int to sequence of int
        For blocks that `can_cut` allows, the first compartment of each piece but the first piece,
        ascending, counted from the block's start.
    """
    bounds = [[0, *cuts.get(b, ()), int(n)] for b, n in enumerate(np.diff(image.blocks.start))]
    division = _divided(image, bounds)
    # `like` ascends, so a block's number occurs first at the block's first piece.
    first_piece = np.searchsorted(division.like, np.arange(image.n_blocks))
    groups: list[Group] = []
    kept: list[list[KeptPiece]] = []
    for group in groups_of(image):
        parts = _cut_group(group, bounds[group.block], int(first_piece[group.block]))
        kept.append([KeptPiece(len(groups) + i, axon) for i, (_, axon) in enumerate(parts)])
        groups += [part for part, _ in parts]
    routes = [
        part
        for route in routes_of(image)
        for to in kept[route.group]
        for part in _cut_route(route, to, bounds, first_piece)
    ]
    return assemble(image, division, groups, routes)


def _divided(image: ChipImage, bounds: list[list[int]]) -> Division:
    like = np.repeat(np.arange(len(bounds)), [len(ends) - 1 for ends in bounds])
    first = [
        start + at
        for start, ends in zip(image.blocks.start, bounds, strict=False)
        for at in ends[:-1]
    ]
    entries = tuple(
        entry if len(ends) == 2 else _piece(entry, i, len(ends) - 1)
        for entry, ends in zip(image.manifest.blocks, bounds, strict=True)
        for i in range(len(ends) - 1)
    )
    start = np.append(first, image.n_compartments)
    return Division(start, np.arange(len(like)), like, entries)


def _piece(entry: BlockEntry, number: int, count: int) -> BlockEntry:
    """Return the manifest's entry of a piece."""
    return replace(entry, cut=(*entry.cut, (number, count)))


def _cut_group(group: Group, ends: list[int], first_piece: int) -> list[tuple[Group, np.ndarray]]:
    """Return the pieces of a group that have axons, and their axon, or -1, for each group axon."""
    if len(ends) == 2:
        return [(group._replace(block=first_piece), np.arange(len(group.axon_row)))]
    # Axons that read a row from the same base go on sharing one row, which keeps the memory small.
    number: dict[tuple[int, int], int] = {}
    reads = zip(group.axon_row.tolist(), group.axon_base.tolist(), strict=True)
    list_of = np.array([number.setdefault(read, len(number)) for read in reads], dtype=int)
    lists = np.array(list(number), dtype=int).reshape(-1, 2)
    stretches = _stretches(group.rows, lists, ends)
    parts = [
        _part(group, list_of, *stretch, first, first_piece + i)
        for i, (stretch, first) in enumerate(zip(stretches, ends[:-1], strict=True))
    ]
    return [(part, axon) for part, axon in parts if len(part.axon_row)]


def _part(
    group: Group, list_of: np.ndarray, held: np.ndarray, rows: SpikeRows, first: int, piece: int
) -> tuple[Group, np.ndarray]:
    """Return a group's part with targets in a stretch, and its axon, or -1, for each group axon.

    ``list_of`` is the list that each axon reads. ``held`` is a mask of the lists with targets in
    the stretch, and ``rows`` are their rows.
    """
    # The piece has no axon for a group axon without a target in this stretch.
    used = held[list_of]
    axon = np.where(used, np.cumsum(used) - 1, -1)
    row = (np.cumsum(held) - 1)[list_of[used]]
    # A base below 0 would mark an unused axon. So a base before the stretch becomes 0, and the
    # indices of `_stretches` make up for it.
    base = np.maximum(group.axon_base[used] - first, 0)
    return Group(group.like, piece, rows, row, base), axon


def _stretches(
    rows: SpikeRows, lists: np.ndarray, ends: list[int]
) -> Iterator[tuple[np.ndarray, SpikeRows]]:
    """Yield, for each stretch, a mask of the lists with targets in it, and their parts as rows.

    ``lists`` (n, 2) holds rows of one atom, each with the base that it is read from.
    """
    row, base = lists.T
    # A list without a base delivers nothing: it gets no synapses.
    n = np.where(base >= 0, rows.sizes[row], 0)
    of, synapse = np.repeat(np.arange(len(lists)), n), ranges(rows.start[row], n)
    target = base[of] + rows.indices[synapse]
    stretch = np.searchsorted(ends, target, side="right") - 1
    first = np.asarray(ends)[stretch]
    indices = target - first - np.maximum(base[of] - first, 0)
    # Stable: synapses of a list stay in order.
    place = stretch * len(lists) + of
    order = np.argsort(place, kind="stable")
    weights, indices = rows.weights[synapse][order], indices[order]
    sizes = np.bincount(place, minlength=(len(ends) - 1) * len(lists))
    begin = 0
    for mine in sizes.reshape(len(ends) - 1, len(lists)):
        end, held = begin + int(mine.sum()), mine > 0
        start = offsets(mine[held])
        atoms = np.ones(len(start) - 1, dtype=int)
        yield held, SpikeRows(atoms, start, weights[begin:end], indices[begin:end])
        begin = end


def _cut_route(
    route: Route, to: KeptPiece, bounds: list[list[int]], first_piece: np.ndarray
) -> Iterator[Route]:
    """Yield a route to one piece of a group from each piece of the source that reaches it."""
    axon = np.where(route.axon >= 0, to.axon[route.axon], -1)
    ends, first_of = [0, len(axon)], route.source
    if not route.of_input:
        ends, first_of = bounds[route.source], int(first_piece[route.source])
    n_axons = np.diff(offsets(axon >= 0)[ends])
    for i in np.flatnonzero(n_axons).tolist():
        mine = slice(ends[i], ends[i + 1])
        yield Route(route.of_input, first_of + i, to.group, axon[mine], route.atom[mine])
