"""Costs of one spike of every source, on the cores where it arrives."""

from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import Deliveries, deliveries, row_lengths


class Fanout(NamedTuple):
    """Costs of one spike, by source and destination core; both of shape (n_sources, n_cores)."""

    synaptic_operations: np.ndarray
    """Synapses read: the sum of the row lengths of the axons the spike reaches."""
    messages: np.ndarray
    """Messages, 1 where the core receives the spike: one per spike and destination core."""


class Reach(NamedTuple):
    """Pairs of a source and a core that its spikes reach, each pair once; arrays of (n,).

    Attributes
    ----------
    source, core : array
        The source and the core; pairs are in order of the source, then of the core.
    synaptic_operations : array
        Synapses that a spike of the source reads on the core.
    """

    source: np.ndarray
    core: np.ndarray
    synaptic_operations: np.ndarray


def reach(image: ChipImage) -> Reach:
    """Count the cost of a spike of every source, on each core that it reaches."""
    paths = deliveries(image)
    pairs, number = np.unique(
        paths.source * image.n_cores + image.group_core[paths.group], return_inverse=True
    )
    read = np.zeros(len(pairs), dtype=np.int64)
    np.add.at(read, number, _read(image, paths))
    return Reach(*np.divmod(pairs, image.n_cores), read)


def fanout(image: ChipImage) -> Fanout:
    """Count the fan-out of every source of an image."""
    shape = (image.n_sources, image.n_cores)
    operations, messages = np.zeros((2, *shape), dtype=np.int32)
    source, core, read = reach(image)
    messages[source, core] = 1
    operations[source, core] = read
    return Fanout(operations, messages)


def all_operations(image: ChipImage) -> int:
    """Return the synaptic operations of a step in which every source spikes."""
    return int(_read(image, deliveries(image)).sum())


def _read(image: ChipImage, paths: Deliveries) -> np.ndarray:
    """Return the number of synapses that a spike reads on each of its paths."""
    has_base = image.in_axons.base[paths.axon] >= 0
    return np.where(has_base, row_lengths(image)[paths.row], 0)
