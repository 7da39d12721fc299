"""What drives each compartment of an image: which neurons are copies of others, which cannot fire.

Both are told from the image's integers alone, as the chip sees them.
"""

import numpy as np

from spikeport.compile.image import ChipImage
from spikeport.compile.outputs import readout_compartments
from spikeport.compile.synapses import n_sources, synapses_of

ALIKE = ("bias", "decay_u", "decay_v", "vth", "refract_delay")
ONE = 4096  # decays are in 1/4096


def duplicated(image: ChipImage) -> np.ndarray:
    """(n_compartments,) whether a neuron is equal to an earlier one of its block, in all it gets.

    Equal are weights from every source, bias, decays, threshold and refractory period. Weights are
    compared by two sums with random factors for every source. Read-outs and neurons with noise or
    learning are not copies.
    """
    factors = np.random.RandomState(0).randint(1, 2**31, (2, n_sources(image))).astype(np.uint64)
    sums = np.zeros((2, image.n_compartments), dtype=np.uint64)  # wraps around, as a hash may
    for synapses in synapses_of(image):
        weight = image["weights"][synapses.number].astype(np.int64).astype(np.uint64)
        for total, factor in zip(sums, factors, strict=True):  # much faster than both at once
            np.add.at(total, synapses.target, weight * factor[synapses.source])
    block = np.repeat(np.arange(image.n_blocks), np.diff(image["block_start"]))
    own = np.stack([image[name].astype(np.int64) for name in ALIKE] + [block], axis=1)
    rows = np.concatenate([own.view(np.uint64), sums.T], axis=1)
    first = np.unique(rows, axis=0, return_index=True)[1]
    copies = np.ones(image.n_compartments, dtype=bool)
    copies[first] = False
    return copies & _ordinary(image)


def silenced(image: ChipImage) -> np.ndarray:
    """(n_compartments,) whether a neuron stays below threshold whatever the input.

        u_max = 4096 q_max / (decay_u + 1),   v_max = 4096 (u_max + bias) / decay_v

    where q_max is the sum of a neuron's positive weights: every excitatory source spikes in every
    step, and no other. Read-outs and neurons with noise or learning are not silenced.
    """
    most = np.zeros(n := image.n_compartments)
    for synapses in synapses_of(image):
        positive = np.maximum(image["weights"][synapses.number], 0)
        most += np.bincount(synapses.target, weights=positive, minlength=n)
    current = most * ONE / (image["decay_u"] + 1.0) + image["bias"]
    with np.errstate(divide="ignore", invalid="ignore"):
        voltage = np.where(current > 0, current * ONE / image["decay_v"], 0)
    return (voltage <= image["vth"]) & _ordinary(image)


def _ordinary(image: ChipImage) -> np.ndarray:
    """(n_compartments,) neurons that spike, and whose integers say all of them."""
    ordinary = image["enable_noise"] == 0
    ordinary[readout_compartments(image)] = False
    learning = image["synapse_block"][image["synapse_learning"][:, 0] == 1]
    for block in learning:
        ordinary[image.part("block_start", block)] = False
    return ordinary
