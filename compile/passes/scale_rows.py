"""`ScaleRows`: rows of weights of very different size are brought closer together."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from nengo_loihi.block import LoihiBlock, Synapse
from pydantic import Field

from spikeport.compile.loihi.blocks import FloatBlocks, copied
from spikeport.compile.loihi.discretise import largest_weights, weight_exponent
from spikeport.compile.passes.base import BlockPass, Context

LEAST = 2.0**-12
"""The share of the block's largest weight below which weights do not count: numbers that are 0
up to rounding are scattered over all magnitudes, and a threshold has 17 bits."""


@dataclass(frozen=True)
class ScaleRows(BlockPass):
    """Scale a compartment's weights, bias and threshold by 2^-k, so that weights survive 8 bits.

    The weights of a block share a scale, so neurons of small gain lose their weights beside
    neurons of large gain. A compartment's input, state and threshold may be scaled together without
    changing when it spikes; powers of two make that exact. Each value of k takes a threshold
    profile of the core.

    A block stays as it is if it learns, has noise or a lower bound of the voltage other than zero,
    or if its current or voltage is read.

    Attributes
    ----------
    profiles : int
        The most thresholds in one block.
    """

    name: ClassVar[str] = "scale_rows"
    profiles: Annotated[int, Field(ge=1)] = 3

    def apply(self, floats: FloatBlocks, context: Context) -> FloatBlocks:
        """Scale the compartments of every block that can be scaled."""
        most = int(min(self.profiles, context.chip.limits.most("threshold_profiles")))
        read = _read(floats)
        changed = {
            block: exponents
            for block in floats.blocks
            if block not in read
            and _can_scale(block)
            and (exponents := _exponents(block, most)).any()
        }
        context.note("blocks", {"scaled": len(changed), "of": len(floats.blocks)})
        return floats.with_blocks(
            _scaled(block, changed[block]) if block in changed else block for block in floats.blocks
        )


def _read(floats: FloatBlocks) -> set[LoihiBlock]:
    """Return the blocks whose current or voltage is read."""
    # The host decodes a state in the units of the compartment as it was built.
    probes = (probe for probe in floats.model.probes if probe.key != "spiked")
    read = {block for probe in probes for block in probe.target}
    pairs = zip(floats.model.blocks, floats.blocks, strict=True)
    return {now for built, now in pairs if built in read}


def _can_scale(block: LoihiBlock) -> bool:
    state = block.compartment
    # Noise and the lower bound of voltages are the same for all compartments of a block.
    plain = np.unique(state.vth).size == 1 and not state.enable_noise.any() and state.vmin == 0
    return plain and not any(synapse.learning or _shifted(synapse) for synapse in block.synapses)


def _shifted(synapse: Synapse) -> bool:
    """Return whether a synapse's indices count from a base, and are not numbers of compartments."""
    bases = synapse.axon_compartment_bases
    return bases is not None and bool(np.any(np.asarray(bases) > 0))


def _exponents(block: LoihiBlock, profiles: int) -> np.ndarray:
    """Return the k of each compartment, (n,), with at most ``profiles`` different values.

    Compartments with k = 0 keep their threshold. If it is large beside the weights, it limits the
    block's scale: scaled compartments would lose bits, and others gain none. Then k is smaller, or
    0.
    """
    wanted = _wanted(largest_weights(block))
    if not wanted.any():
        return wanted
    unscaled = weight_exponent(block, np.zeros_like(wanted))
    for most in range(wanted.max(), 0, -1):
        k = _thinned(wanted.clip(max=most), profiles)
        if weight_exponent(block, k) >= unscaled:
            return k
    return np.zeros_like(wanted)


def _wanted(largest: np.ndarray) -> np.ndarray:
    """Return the k, (n,), that bring the largest weights into all compartments to one size.

    This size is the 10 % quantile of the largest weights, so that outliers cost no profiles.
    """
    used = largest[largest > LEAST * largest.max(initial=0)]
    if used.size == 0:
        return np.zeros(len(largest), dtype=int)
    with np.errstate(divide="ignore"):
        k = np.floor(np.log2(largest / np.quantile(used, 0.1))).clip(min=0)
    result: np.ndarray = k.astype(int)
    return result


def _thinned(k: np.ndarray, profiles: int) -> np.ndarray:
    """Round k down to fewer different values, since a core has few threshold profiles."""
    step = -(-(k.max() + 1) // profiles)
    result: np.ndarray = k // step * step
    return result


def _scaled(block: LoihiBlock, exponents: np.ndarray) -> LoihiBlock:
    # Powers of two lose nothing.
    factor = np.exp2(-exponents).astype(np.float32)
    block = copied(block)
    block.compartment.vth *= factor
    block.compartment.bias *= factor
    for synapse in block.synapses:
        pairs = zip(synapse.weights, synapse.indices, strict=True)
        synapse.weights = [weights * factor[indices] for weights, indices in pairs]
    return block
