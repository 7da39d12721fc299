"""The numbers of an image in floating point, before and after rounding.

Both are in the units of nengo-loihi's floating-point blocks, where a threshold is usually 1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spikeport.compile.ground.quantisation import (
    BlockNeurons,
    BlockValues,
    block_values,
    restored_block,
)
from spikeport.compile.image.tables import flat
from spikeport.compile.loihi.blocks import IntegerBlocks


@dataclass(frozen=True)
class Numbers:
    """Weights (n_weights,) and the constants of neurons, each (n_compartments,), of all blocks.

    The order is that of the arrays of an image that no pass has changed. ``to_integers`` is the
    number of the chip's units in a voltage of 1.
    """

    weights: np.ndarray
    bias: np.ndarray
    vth: np.ndarray
    decay_u: np.ndarray
    decay_v: np.ndarray
    scale_u: np.ndarray
    scale_v: np.ndarray
    vmin: np.ndarray
    vmax: np.ndarray
    to_integers: np.ndarray

    def with_part(self, name: str, other: "Numbers", part: slice) -> "Numbers":
        """Return these numbers, with a part of one array taken from ``other``."""
        mixed = getattr(self, name).copy()
        mixed[part] = getattr(other, name)[part]
        return replace(self, **{name: mixed})


def wanted(blocks: IntegerBlocks) -> Numbers:
    """Return the numbers before they were rounded."""
    return _numbers(blocks, [block_values(block) for block in blocks.floats.blocks])


def restored(blocks: IntegerBlocks) -> Numbers:
    """Return the integers in floating point: divided by the scales they were made with."""
    pairs = zip(blocks.floats.blocks, blocks.blocks, strict=True)
    found = [restored_block(block_values(before), after) for before, after in pairs]
    return _numbers(blocks, found)


def _numbers(blocks: IntegerBlocks, values: Sequence[BlockValues]) -> Numbers:
    scales = [np.full(b.n_neurons, b.discretize_info["v_scale"]) for b in blocks.blocks]
    constants = {
        name: _joined(getattr(one.neurons, name) for one in values) for name in BlockNeurons._fields
    }
    return Numbers(
        weights=_joined(weights for one in values for weights in one.weights),
        bias=_joined(one.bias for one in values),
        to_integers=_joined(scales),
        **constants,
    )


def _joined(arrays: Iterable[np.ndarray]) -> np.ndarray:
    return flat([np.asarray(array, dtype=float) for array in arrays], float)
