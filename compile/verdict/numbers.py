"""The numbers of an image in floating point: as they were wanted, and as rounding left them.

Both are in the units of nengo-loihi's floating-point blocks, where a threshold is usually 1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spikeport.compile import quantisation
from spikeport.compile.build import Blocks
from spikeport.compile.extract import flat
from spikeport.compile.quantisation import FloatBlock, Neurons

ROUNDED = ("weights", "bias", "vth", "decay_u", "decay_v")
"""What the discretiser rounds."""


@dataclass(frozen=True)
class Numbers:
    """Weights (n_weights,) and the constants of neurons, each (n_compartments,), of all blocks.

    The order is that of the arrays of an image that no pass has changed. ``to_integers`` is the
    number of the chip's units that make 1 of a voltage here.
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
        """These numbers, but for a part of one array that is another's."""
        mixed = getattr(self, name).copy()
        mixed[part] = getattr(other, name)[part]
        return replace(self, **{name: mixed})


def wanted(blocks: Blocks) -> Numbers:
    """The numbers before they were rounded."""
    return _numbers(blocks, [blocks.floats[block] for block in blocks.model.blocks])


def restored(blocks: Blocks) -> Numbers:
    """The integers, back in floating point: divided by the scales they were made with."""
    pairs = [(blocks.floats[block], block) for block in blocks.model.blocks]
    return _numbers(blocks, [quantisation.restored(*pair) for pair in pairs])


def _numbers(blocks: Blocks, floats: Sequence[FloatBlock]) -> Numbers:
    scales = [np.full(b.n_neurons, b.discretize_info["v_scale"]) for b in blocks.model.blocks]
    return Numbers(
        weights=_joined(weights for one in floats for weights in one.weights),
        bias=_joined(one.bias for one in floats),
        to_integers=_joined(scales),
        **{name: _joined(getattr(one.neurons, name) for one in floats) for name in Neurons._fields},
    )


def _joined(arrays: Iterable[np.ndarray]) -> np.ndarray:
    return flat([np.asarray(array, dtype=float) for array in arrays], float)
