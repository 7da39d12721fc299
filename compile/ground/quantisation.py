"""The cost of rounding to the chip's integers, block by block.

    error = rms(restored - wanted) / rms(wanted)

where ``wanted`` are the builder's floating-point weights (or biases, thresholds, decays) of a block
and ``restored`` the integers divided by the scales that nengo-loihi's discretiser chose for it.
"""

from typing import NamedTuple

import numpy as np
from nengo_loihi.block import LoihiBlock, SynapseConfig

from spikeport.constants import DECAY_UNITS

ROUNDED = ("vth", "decay_u", "decay_v")
"""Constants of neurons that the discretiser rounds, besides the bias."""
ZERO = 1e-9
"""Share of a block's largest weight up to which a weight counts as 0."""


class BlockNeurons(NamedTuple):
    """Constants of the compartments of a block, each array (n,)."""

    decay_u: np.ndarray
    decay_v: np.ndarray
    vth: np.ndarray
    vmin: np.ndarray
    vmax: np.ndarray
    scale_u: np.ndarray
    """1 where the input is scaled by ``decay_u``."""
    scale_v: np.ndarray


class BlockValues(NamedTuple):
    """The values of a block: as they were built, or restored from integers.

    ``weights`` and ``indices`` have an array for each group of synapses.
    """

    bias: np.ndarray
    weights: list[np.ndarray]
    indices: list[np.ndarray]
    neurons: BlockNeurons


class BlockError(NamedTuple):
    """Relative rms error of a block's numbers (0 where there are none)."""

    label: str
    weights: float
    bias: float
    lost_weights: float
    """Share of the non-zero weights that became zero."""
    threshold: float = 0.0
    current_decay: float = 0.0
    voltage_decay: float = 0.0


def block_values(block: LoihiBlock) -> BlockValues:
    """Return the values of a block."""
    indices = [_joined(synapse.indices) for synapse in block.synapses]
    comp, n = block.compartment, block.n_neurons
    neurons = BlockNeurons(
        *(np.broadcast_to(getattr(comp, name), n) for name in BlockNeurons._fields)
    )
    return BlockValues(comp.bias, _weights(block), indices, neurons)


def restored_block(wanted: BlockValues, block: LoihiBlock) -> BlockValues:
    """Return the integers of a discretised block, divided by their scales."""
    info, comp = block.discretize_info, block.compartment
    scale = np.broadcast_to(
        info["w_scale"] * SynapseConfig.get_scale(info["w_exp"]), block.n_neurons
    )
    weights = [w / scale[i] for w, i in zip(_weights(block), wanted.indices, strict=True)]
    neurons = wanted.neurons._replace(
        vth=comp.vth / info["v_scale"],
        decay_u=(comp.decay_u + 1) / DECAY_UNITS,  # the chip adds 1
        decay_v=comp.decay_v / DECAY_UNITS,
    )
    return BlockValues(comp.bias / info["b_scale"], weights, wanted.indices, neurons)


def block_error(label: str, wanted: BlockValues, block: LoihiBlock) -> BlockError:
    """Compare a discretised block with its floating-point values."""
    found = restored_block(wanted, block)
    pairs = [(getattr(found.neurons, name), getattr(wanted.neurons, name)) for name in ROUNDED]
    weights = abs(_flat(wanted.weights))
    # Some transforms have zeros that are only nearly so, as those of circular convolution.
    nonzero = weights > ZERO * weights.max(initial=0)
    lost = np.mean(_flat(_weights(block))[nonzero] == 0) if nonzero.any() else 0.0
    return BlockError(
        label,
        relative_rms(_flat(found.weights), _flat(wanted.weights)),
        relative_rms(found.bias, wanted.bias),
        float(lost),
        *(relative_rms(*pair) for pair in pairs),
    )


def relative_rms(found: np.ndarray, wanted: np.ndarray) -> float:
    """Return rms(found - wanted) / rms(wanted); 0 where all wanted values are 0."""
    norm = np.linalg.norm(wanted)
    return float(np.linalg.norm(found - wanted) / norm) if norm > 0 else 0.0


def _weights(block: LoihiBlock) -> list[np.ndarray]:
    """Return the weights of each group of synapses, which are integers once discretised."""
    return [_joined(synapse.weights) for synapse in block.synapses]


def _joined(rows: list[np.ndarray]) -> np.ndarray:
    """Return rows laid end to end."""
    return _flat([row.ravel() for row in rows])


def _flat(arrays: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(arrays) if arrays else np.zeros(0)
