"""What one spike of every source costs where it arrives.

Sources are all compartments of an image followed by the neurons of its inputs. A spike reaches an
input axon through each of its source's routes, and there every synapse of the axon's row is read.
"""

from typing import NamedTuple

import numpy as np

from spikeport.compile.image import ChipImage
from spikeport.compile.usage import synapse_core


class Fanout(NamedTuple):
    """Costs of one spike, per source and destination core; both of shape (n_sources, n_cores)."""

    synaptic_operations: np.ndarray
    """Synapses read: the sum of the row lengths of the axons the spike reaches."""
    messages: np.ndarray
    """1 where the core receives the spike: one message per spike and destination core."""


def fanout(image: ChipImage) -> Fanout:
    """Count the fan-out of every source of an image."""
    first_source = first_sources(image)
    n_sources = image.n_compartments + int(image["input_size"].sum())
    operations = np.zeros((n_sources, image.n_cores), dtype=np.int32)
    messages = np.zeros((n_sources, image.n_cores), dtype=np.int32)
    cores = synapse_core(image)
    for route, group in enumerate(image["route_synapse"]):
        axons = image["route_axon"][image.part("route_start", route)]
        used = np.flatnonzero(axons >= 0)
        sources = first_source[route] + used
        axons = image["in_axon_start"][group] + axons[used]
        messages[sources, cores[group]] = 1
        operations[sources, cores[group]] += _row_lengths(image, group, axons)
    return Fanout(operations, messages)


def first_sources(image: ChipImage) -> np.ndarray:
    """(n_routes,) number of the first source of each route."""
    inputs = image.n_compartments + np.concatenate([[0], np.cumsum(image["input_size"])])
    source = image["route_source"]
    of_input = image["route_input"] == 1
    first = image["block_start"][np.where(of_input, 0, source)]
    first[of_input] = inputs[source[of_input]]
    return first


def _row_lengths(image: ChipImage, group: int, axons: np.ndarray) -> np.ndarray:
    rows = image["row_start"][group] + image["in_axon_row"][axons]
    sizes = image["row_weight_start"][rows + 1] - image["row_weight_start"][rows]
    lengths = sizes // np.maximum(image["row_atoms"][rows], 1)
    return np.where(image["in_axon_base"][axons] >= 0, lengths, 0)
