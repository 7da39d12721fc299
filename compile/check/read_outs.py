"""Rule SP426: spikes that a read-out loses one by one.

A read-out adds up the weights of the spikes of a step, w = D / dt for decoders D. It spikes itself,
and its value is lost, where

    sum of w > threshold        threshold = 10 radii

Neurons that are few or slow have large decoders: then a single spike is beyond the threshold.
"""

import math
from collections.abc import Iterator

import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import synapses_of
from spikeport.compile.image.tables import part


def single_spike_hints(image: ChipImage) -> Iterator[Violation]:
    """Yield a hint on each read-out that loses single spikes."""
    read_outs = np.array([entry.kind == "readout" for entry in image.manifest.blocks])
    largest = _largest(image, read_outs)
    for block in np.flatnonzero(read_outs).tolist():
        mine = part(image.blocks.start, block)
        times = float((largest[mine] / image.compartments.vth[mine]).max())
        if times > 1:
            used = f"up to {times:.3g} times the threshold"
            # Two neurons may well spike in one step.
            factor = f"{2 * math.ceil(times)}"
            label = image.manifest.blocks[block].label
            yield rules.get("SP426").broken(label, used, factor=factor)


def _largest(image: ChipImage, blocks: np.ndarray) -> np.ndarray:
    """Return the largest weight into each compartment, (n_compartments,), of a mask of blocks."""
    largest = np.zeros(image.n_compartments)
    for route in synapses_of(image, blocks):
        np.maximum.at(largest, route.target, image.synapses.weight[route.number].astype(float))
    return largest
