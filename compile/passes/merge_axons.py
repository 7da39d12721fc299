"""`MergeAxons`: sources with equal weights share one input axon."""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import offsets
from spikeport.compile.image.usage import AMOUNTS, block_amounts, is_consecutive
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.connectivity import (
    Group,
    Route,
    SpikeRows,
    assemble,
    division_of,
    groups_of,
    routes_of,
)
from spikeport.hardware_models.chip import ChipModel

_TYPE = np.dtype(np.int32)
"""A type that holds all weights and all targets of an image."""


@dataclass(frozen=True)
class MergeAxons(ImagePass):
    """Let sources whose spikes do the same share an input axon, and drop axons that do nothing.

    Synapse groups of a block that store their rows in the same format become one group. It stores
    equal rows once, and axons that read equal rows from equal bases become one axon: the chip
    counts its spikes, so they add up. Groups that learn stay as they are.
    """

    name: ClassVar[str] = "merge_axons"
    precedes: ClassVar[tuple[str, ...]] = ("split", "pack", "place")

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Merge the groups, rows and axons of an image."""
        merged = _merged(image)
        for name in ("in_axons", "out_axons", "synapse_bits"):
            before, after = (_amount(one, name, context.chip) for one in (image, merged))
            context.note_change(name, before, after)
        return merged


def _amount(image: ChipImage, name: str, chip: ChipModel) -> int:
    return int(block_amounts(image, chip)[:, AMOUNTS.index(name)].sum())


def _merged(image: ChipImage) -> ChipImage:
    groups, routes = groups_of(image), routes_of(image)
    bundles: dict[Hashable, _Bundle | _Whole] = {}
    keys, new = _keys(image), []
    for group, key, used in zip(groups, keys, _used(groups, routes), strict=True):
        bundle = _Whole(group) if image.learns[group.like] else _Bundle(group)
        new.append(bundles.setdefault(key, bundle).add(group, used))
    kept = {key: bundle.group() for key, bundle in bundles.items()}
    # Groups that no spike reaches, or whose weights are all 0, are left out.
    filled = [key for key, group in kept.items() if len(group.axon_row)]
    number = {key: n for n, key in enumerate(filled)}
    leading = [
        route._replace(group=number[keys[route.group]], axon=axon)
        for route in routes
        if ((axon := _mapped(new[route.group], route.axon)) >= 0).any()
    ]
    return assemble(image, division_of(image), [kept[key] for key in filled], leading)


def _mapped(axons: np.ndarray, axon: np.ndarray) -> np.ndarray:
    """Return the new number of each axon, or -1 if it has none; a group may have no axons."""
    new = np.full(len(axon), -1)
    new[axon >= 0] = axons[axon[axon >= 0]]
    return new


def _keys(image: ChipImage) -> list[Hashable]:
    """Return a key for each group: groups with equal keys can be joined."""
    # A group that learns has its own number as the key, so that nothing joins it.
    near, block, learns = is_consecutive(image), image.groups.block, image.learns
    kind, form = image.groups.pop_type, image.groups.format
    return [
        n if learns[n] else (block[n], kind[n], near[n], form[n].tobytes())
        for n in range(len(block))
    ]


def _used(groups: Sequence[Group], routes: Sequence[Route]) -> list[np.ndarray]:
    """Return a mask of the axons of each group that spikes reach and that have an effect."""
    used = [np.zeros(len(group.axon_row), dtype=bool) for group in groups]
    for route in routes:
        used[route.group][route.axon[route.axon >= 0]] = True
    for group, mine in zip(groups, used, strict=True):
        row_of = np.repeat(np.arange(len(group.rows)), group.rows.sizes)
        acts = np.zeros(len(group.rows), dtype=bool)
        acts[row_of[group.rows.weights != 0]] = True
        mine &= (group.axon_base >= 0) & acts[group.axon_row]
    return used


class _Bundle:
    """Groups that become one: their distinct rows, and axons by row and base."""

    def __init__(self, first: Group) -> None:
        self._like, self._block = first.like, first.block
        self._rows: dict[_Content, int] = {}
        self._axons: dict[tuple[int, int], int] = {}

    def add(self, group: Group, used: np.ndarray) -> np.ndarray:
        """Add the used axons of a group, and return the new number of each of its axons, or -1."""
        contents = _contents(group.rows)
        new = np.full(len(group.axon_row), -1)
        for i in np.flatnonzero(used).tolist():
            content = contents[group.axon_row[i]]
            place = (self._rows.setdefault(content, len(self._rows)), int(group.axon_base[i]))
            new[i] = self._axons.setdefault(place, len(self._axons))
        return new

    def group(self) -> Group:
        """Return the group that the added groups become."""
        places = np.array(list(self._axons), dtype=int).reshape(-1, 2)
        return Group(self._like, self._block, _rows(self._rows), places[:, 0], places[:, 1])


class _Content(NamedTuple):
    """A row as bytes, which compare in one operation, and its number of atoms.

    Rows with equal bytes may have different numbers of atoms.
    """

    atoms: int
    weights: bytes
    indices: bytes


def _contents(rows: SpikeRows) -> list[_Content]:
    weights, indices = (np.asarray(one, _TYPE).tobytes() for one in (rows.weights, rows.indices))
    bounds = pairwise((rows.start * _TYPE.itemsize).tolist())
    return [
        _Content(atoms, weights[a:b], indices[a:b])
        for atoms, (a, b) in zip(rows.atoms.tolist(), bounds, strict=True)
    ]


def _rows(contents: Iterable[_Content]) -> SpikeRows:
    contents = list(contents)
    return SpikeRows(
        np.array([row.atoms for row in contents], dtype=int),
        offsets(len(row.weights) // _TYPE.itemsize for row in contents),
        np.frombuffer(b"".join(row.weights for row in contents), _TYPE),
        np.frombuffer(b"".join(row.indices for row in contents), _TYPE),
    )


class _Whole:
    """A group that stays as it is."""

    def __init__(self, group: Group) -> None:
        self._group = group

    def add(self, group: Group, used: np.ndarray) -> np.ndarray:
        """Return the numbers of the axons, which stay the same; see `_Bundle.add`."""
        return np.arange(len(group.axon_row))

    def group(self) -> Group:
        """Return the group as it is."""
        return self._group
