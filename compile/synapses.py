"""Every synapse of an image, from the source whose spikes read it to the compartment it acts on.

Sources are all compartments of an image followed by the neurons of its inputs.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from spikeport.compile.extract import offsets
from spikeport.compile.fanout import first_sources
from spikeport.compile.image import ChipImage


class Synapses(NamedTuple):
    """Every synapse that the spikes of one route read, each array (n,).

    ``number`` is that of its weight in the image's ``weights``.
    """

    source: np.ndarray
    target: np.ndarray
    number: np.ndarray


def n_sources(image: ChipImage) -> int:
    """How many sources an image has."""
    return image.n_compartments + int(image["input_size"].sum())


def synapses_of(image: ChipImage) -> Iterator[Synapses]:
    """The synapses of every route."""
    for route, first in enumerate(first_sources(image)):
        part = image.part("route_start", route)
        axon, atom = image["route_axon"][part], image["route_atom"][part]
        group = image["route_synapse"][route]
        used = np.flatnonzero(axon >= 0)
        axon = image["in_axon_start"][group] + axon[used]
        used, axon = used[image["in_axon_base"][axon] >= 0], axon[image["in_axon_base"][axon] >= 0]
        row = image["row_start"][group] + image["in_axon_row"][axon]
        sizes = np.diff(image["row_weight_start"])[row] // image["row_atoms"][row]
        begin = image["row_weight_start"][row] + atom[used] * sizes
        number = ranges(begin, sizes)
        base = image["block_start"][image["synapse_block"][group]] + image["in_axon_base"][axon]
        target = np.repeat(base, sizes) + image["indices"][number]
        yield Synapses(np.repeat(first + used, sizes), target, number)


def ranges(begin: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Ranges of the given sizes from the given beginnings on, end to end."""
    return np.arange(sizes.sum()) + np.repeat(begin - offsets(sizes)[:-1], sizes)
