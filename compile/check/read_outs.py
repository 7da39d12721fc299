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
    largest = _largest(image)
    for block, entry in enumerate(image.manifest.blocks):
        mine = part(image.blocks.start, block)
        times = float((largest[mine] / image.compartments.vth[mine]).max())
        if entry.kind == "readout" and times > 1:
            used = f"up to {times:.3g} times the threshold"
            # Two neurons may well spike in one step.
            factor = f"{2 * math.ceil(times)}"
            yield rules.get("SP426").broken(entry.label, used, factor=factor)


def _largest(image: ChipImage) -> np.ndarray:
    """Return the largest weight into each compartment of a read-out, (n_compartments,)."""
    largest = np.zeros(image.n_compartments)
    read_outs = np.array([entry.kind == "readout" for entry in image.manifest.blocks])
    for route in synapses_of(image, read_outs):
        np.maximum.at(largest, route.target, image.synapses.weight[route.number].astype(float))
    return largest
