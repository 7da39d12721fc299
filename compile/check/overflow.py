"""Rule SP423: sums of weights that the chip's register of a neuron's input may not hold.

The register has 22 bits, and wraps around: an input q is lost, and gets the other sign, where

    q < -2^21   or   q >= 2^21

nengo-loihi's emulator warns of it while it runs. The kernels add in any order, modulo 2^22, and do
not notice it.
"""

from collections.abc import Iterator

import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import sums_by_target, synapses_of
from spikeport.compile.image.manifest import SUM_BITS
from spikeport.compile.image.tables import part

MOST = 1 << (SUM_BITS - 1)
"""The size of an input from which it wraps around."""


def overflow_hints(image: ChipImage) -> Iterator[Violation]:
    """Yield a hint on each block with inputs that wrap around if ensembles spike at once."""
    # A bound that is much faster to compute is small enough for most blocks.
    at_risk = _blocks_with(image, _bound(image) >= MOST)
    if not at_risk.any():
        return
    sizes = largest(image, at_risk)
    for block in np.flatnonzero(_blocks_with(image, sizes >= MOST)).tolist():
        mine = sizes[part(image.blocks.start, block)]
        used = f"up to {mine.max():,.0f}, in {(mine >= MOST).sum():,} of {len(mine):,} neurons"
        label = image.manifest.blocks[block].label
        yield rules.get("SP423").broken(label, used, f"{MOST - 1:,}")


def largest(image: ChipImage, blocks: np.ndarray | None = None) -> np.ndarray:
    """Return the largest size of each compartment's input from neurons, (n_compartments,).

    An ensemble's neurons spike at once, or none does: weights of both signs, as of values that they
    decode, cancel. Relays and inputs that encode values are no sources here: a value has few, which
    spike in turn. With a mask of ``blocks (n_blocks,)``, the inputs of others are left at 0.
    """
    counts, n = _neurons(image), image.n_compartments
    excited, inhibited = np.zeros((2, n))
    for route in synapses_of(image, blocks):
        weights = image.synapses.weight[route.number] * counts[route.source]
        total = np.bincount(route.target, weights, n)
        excited += np.maximum(total, 0)
        inhibited += np.maximum(-total, 0)
    result: np.ndarray = np.maximum(excited, inhibited)
    return result


def _bound(image: ChipImage) -> np.ndarray:
    """Return the size of each compartment's input if all weights had the same sign."""
    sizes = np.abs(image.synapses.weight.astype(float))
    result: np.ndarray = sums_by_target(image, sizes, _neurons(image).astype(float)[np.newaxis])[0]
    return result


def _blocks_with(image: ChipImage, compartments: np.ndarray) -> np.ndarray:
    """Return the blocks that have one of some compartments, (n_blocks,)."""
    return np.isin(np.arange(image.n_blocks), image.compartment_block[compartments])


def _neurons(image: ChipImage) -> np.ndarray:
    """Return the sources that are neurons of an ensemble, or events of a file, (n_sources,)."""
    ensembles = np.array([entry.kind == "ensemble" for entry in image.manifest.blocks])
    return np.concatenate([ensembles[image.compartment_block], image.sends_spikes])
