"""What rounding to the chip's integers costs, block by block.

    error = rms(restored - wanted) / rms(wanted)

where ``wanted`` are the builder's floating-point weights (or biases) of a block and ``restored``
the integers divided by the scales that nengo-loihi's discretiser chose for it.
"""

from typing import NamedTuple

import numpy as np
from nengo_loihi.block import LoihiBlock, SynapseConfig


class FloatBlock(NamedTuple):
    """The floating-point values of a block, kept from before the discretiser overwrote them."""

    bias: np.ndarray
    weights: list[np.ndarray]
    indices: list[np.ndarray]


class BlockError(NamedTuple):
    """Relative rms error of a block's weights and biases (0 where there are none)."""

    label: str
    weights: float
    bias: float
    lost_weights: float
    """Share of the non-zero weights that became zero."""


def snapshot(block: LoihiBlock) -> FloatBlock:
    """Copy what the discretiser will overwrite."""
    weights = [w.ravel() for synapse in block.synapses for w in synapse.weights]
    indices = [i.ravel() for synapse in block.synapses for i in synapse.indices]
    return FloatBlock(block.compartment.bias.copy(), [w.copy() for w in weights], indices)


def block_error(label: str, wanted: FloatBlock, block: LoihiBlock) -> BlockError:
    """Compare a discretised block with its floating-point values."""
    info = block.discretize_info
    scale = np.broadcast_to(
        info["w_scale"] * SynapseConfig.get_scale(info["w_exp"]), block.n_neurons
    )
    integers = _flat([w.ravel() for synapse in block.synapses for w in synapse.weights])
    weights = _flat(wanted.weights)
    restored = integers / scale[_flat(wanted.indices).astype(int)]
    bias = block.compartment.bias / info["b_scale"]
    nonzero = weights != 0
    lost = np.mean(integers[nonzero] == 0) if nonzero.any() else 0.0
    return BlockError(
        label, _relative(restored, weights), _relative(bias, wanted.bias), float(lost)
    )


def _flat(arrays: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(arrays) if arrays else np.zeros(0)


def _relative(restored: np.ndarray, wanted: np.ndarray) -> float:
    norm = np.linalg.norm(wanted)
    return float(np.linalg.norm(restored - wanted) / norm) if norm > 0 else 0.0
