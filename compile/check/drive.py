"""Neurons of an image that are copies of others, and neurons that cannot fire.

Both are found from the image's integers alone, as the chip sees them.
"""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import sums_by_target
from spikeport.compile.image.tables import part
from spikeport.constants import DECAY_UNITS

ALIKE = ("bias", "decay_u", "decay_v", "vth", "refract_delay")
MANY = 2.0**60
"""Spikes a step of a source that may spike any number of times: they excite any neuron."""


def duplicated(image: ChipImage) -> np.ndarray:
    """Return the neurons that are copies of an earlier neuron of their block, (n_compartments,).

    A copy has equal weights from every source, and equal bias, decays, threshold and refractory
    period. Weights are compared by two sums, with a random factor for every source. Read-outs and
    neurons with noise or learning are not copies.
    """
    factors = np.random.RandomState(0).randint(1, 2**31, (2, image.n_sources)).astype(np.uint64)
    weights = image.synapses.weight.astype(np.int64).astype(np.uint64)
    sums = sums_by_target(image, weights, factors)  # wraps around, as a hash may
    constants = [getattr(image.compartments, name).astype(np.int64) for name in ALIKE]
    own = np.stack([*constants, image.compartment_block], axis=1)
    rows = np.concatenate([own.view(np.uint64), sums.T], axis=1)
    first = np.unique(rows, axis=0, return_index=True)[1]
    copies = np.ones(image.n_compartments, dtype=bool)
    copies[first] = False
    result: np.ndarray = copies & _ordinary(image)
    return result


def silenced(image: ChipImage) -> np.ndarray:
    """Return the neurons that stay below threshold whatever the input, (n_compartments,).

        u_max = 4096 q_max / (decay_u + 1),   v_max = 4096 (u_max + bias) / decay_v

    where q_max, the sum of a neuron's positive weights, is its input if every excitatory source
    spikes in every step, and no other source does. Read-outs, neurons with noise or learning, and
    neurons that an input of kind ``spikes`` excites are not silenced.
    """
    positive = np.maximum(image.synapses.weight, 0).astype(float)
    spikes = np.where(_unbounded(image), MANY, 1.0)
    most = sums_by_target(image, positive, spikes[np.newaxis])[0]
    current = most * DECAY_UNITS / (image.compartments.decay_u + 1.0) + image.compartments.bias
    with np.errstate(divide="ignore", invalid="ignore"):
        voltage = np.where(current > 0, current * DECAY_UNITS / image.compartments.decay_v, 0)
    result: np.ndarray = (voltage <= image.compartments.vth) & _ordinary(image)
    return result


def _unbounded(image: ChipImage) -> np.ndarray:
    """Return the sources that may spike several times in a step, (n_sources,) of bool.

    Inputs of kind ``spikes`` count: events of a file, and spikes of an ensemble on the host.
    """
    return np.concatenate([np.zeros(image.n_compartments, dtype=bool), image.sends_spikes])


def _ordinary(image: ChipImage) -> np.ndarray:
    """Return the neurons that spike and that their integers describe fully, (n_compartments,)."""
    ordinary = image.compartments.enable_noise == 0
    ordinary[image.readouts] = False
    for block in image.groups.block[image.learns]:
        ordinary[part(image.blocks.start, block)] = False
    result: np.ndarray = ordinary
    return result
