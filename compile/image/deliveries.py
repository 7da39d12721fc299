"""The paths of spikes: one walk over routes, axons and rows, which all counts and kernels share.

Sources are all compartments of an image, followed by the spiking sources of its inputs. A spike of
a source takes each of the source's routes that has an output axon for the source. At the end of the
route it reaches an input axon, which adds one atom's weights in a row to compartments of a block.
"""

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from spikeport.compile.image.tables import ranges

if TYPE_CHECKING:
    from spikeport.compile.image.chip_image import ChipImage


class Deliveries(NamedTuple):
    """The paths that spikes can take, route by route, and by source in a route; arrays of (n,).

    Attributes
    ----------
    source : array
        The source, counted through compartments and inputs.
    route, group : array
        The source's route, and the group of synapses that the route leads to.
    axon, row : array
        The input axon and the row of weights, counted through all groups.
    atom : array
        The atom that the spike selects.
    """

    source: np.ndarray
    route: np.ndarray
    group: np.ndarray
    axon: np.ndarray
    row: np.ndarray
    atom: np.ndarray

    def of(self, chosen: np.ndarray | slice) -> "Deliveries":
        """Return some of the paths, by number, mask or slice."""
        return Deliveries(*(array[chosen] for array in self))


def deliveries(image: "ChipImage") -> Deliveries:
    """Return every path that a spike can take to an input axon."""
    routes, groups = image.routes, image.groups
    sizes = np.diff(routes.start)
    used = np.flatnonzero(image.out_axons.axon >= 0)
    route = np.repeat(np.arange(len(routes)), sizes)[used]
    group = routes.group[route]
    axon = groups.axon_start[group] + image.out_axons.axon[used]
    return Deliveries(
        source=first_sources(image)[route] + used - routes.start[route],
        route=route,
        group=group,
        axon=axon,
        row=image.axon_row[axon],
        atom=image.out_axons.atom[used],
    )


def first_sources(image: "ChipImage") -> np.ndarray:
    """Return the number of the first source of each route, (n_routes,)."""
    # Sources of inputs are numbered behind the compartments.
    inputs = image.n_compartments + np.cumsum(image.inputs.size) - image.inputs.size
    first = np.concatenate([image.blocks.start[:-1], inputs])
    result: np.ndarray = first[
        np.where(image.routes.from_input == 1, image.n_blocks, 0) + image.routes.source
    ]
    return result


def row_lengths(image: "ChipImage") -> np.ndarray:
    """Return the number of synapses that a spike reads in each row, for one atom, (n_rows,)."""
    result: np.ndarray = np.diff(image.rows.start) // image.rows.atoms
    return result


class Reached(NamedTuple):
    """Synapses that spikes read, arrays of (n,): from source to target compartment.

    ``number`` is the row in the table ``synapses``.
    """

    source: np.ndarray
    target: np.ndarray
    number: np.ndarray


def synapses_of(image: "ChipImage", blocks: np.ndarray | None = None) -> Iterator[Reached]:
    """Yield the synapses that spikes of each route read, one route after the other.

    In memory all at once, they could be many more than the image stores, since axons share rows.
    With a mask of ``blocks (n_blocks,)``, only synapses into these are read.
    """
    paths = _reading(image)
    if blocks is not None:
        paths = paths.of(blocks[image.groups.block[paths.group]])
    for path, target, number in _synapses(image, paths):
        yield Reached(paths.source[path], target, number)


def sums_by_target(image: "ChipImage", weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the weighted sums of values of the sources, for each target.

        sums[k, j] = sum over all synapses from a source i to j of weights[synapse] values[k, i]

    Parameters
    ----------
    image : ChipImage
        The image.
    weights : (n_synapses,) array
        A weight for each row of the table ``synapses``; the sums have its type.
    values : (n, n_sources) array
        The values of each source; they should be of the same type, since NumPy's ``add.at`` casts
        each number of another one by itself.

    Returns
    -------
    sums : (n, n_compartments) array
    """
    paths = _reading(image)
    # Sources that share an axon and an atom read the same synapses: their values add up first.
    read = paths.axon * (1 + paths.atom.max(initial=0)) + paths.atom
    first, of = np.unique(read, return_index=True, return_inverse=True)[1:]
    shared = np.zeros((len(values), len(read)), dtype=values.dtype)
    for total, value in zip(shared, values, strict=True):
        np.add.at(total, first[of], value[paths.source])
    leads = np.sort(first)
    sums = np.zeros((len(values), image.n_compartments), dtype=weights.dtype)
    for path, target, number in _synapses(image, paths.of(leads)):
        weight = weights[number]
        for total, value in zip(sums, shared, strict=True):  # much faster than all at once
            np.add.at(total, target, weight * value[leads[path]])
    return sums


def targets_of(image: "ChipImage", sources: np.ndarray) -> np.ndarray:
    """Return which compartments a synapse connects with some sources, (n_compartments,).

    ``sources`` (n_sources,) is True for each of them.
    """
    paths, found = _reading(image), np.zeros(image.n_compartments, dtype=bool)
    for _, target, _ in _synapses(image, paths.of(sources[paths.source])):
        found[target] = True
    return found


def _reading(image: "ChipImage") -> Deliveries:
    """Return the paths to axons with a base: to others spikes are sent, but they read nothing."""
    paths = deliveries(image)
    return paths.of(image.in_axons.base[paths.axon] >= 0)


def _synapses(
    image: "ChipImage", paths: Deliveries
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield the synapses on some paths, route by route: number of the path, target, and number."""
    ends = np.searchsorted(paths.route, np.arange(len(image.routes) + 1))
    lengths = row_lengths(image)
    first = image.blocks.start[image.groups.block]
    for begin, end in itertools.pairwise(ends):
        mine = paths.of(slice(begin, end))
        sizes = lengths[mine.row]
        number = ranges(image.rows.start[mine.row] + mine.atom * sizes, sizes)
        target = np.repeat(first[mine.group] + image.in_axons.base[mine.axon], sizes)
        path = np.repeat(np.arange(begin, end), sizes)
        yield path, target + image.synapses.index[number], number
