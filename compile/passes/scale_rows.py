"""`ScaleRows`: rows of weights of very different size are brought closer together."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from nengo_loihi.block import LoihiBlock, Synapse
from pydantic import Field

from spikeport.compile.loihi.blocks import FloatBlocks, copied
from spikeport.compile.loihi.discretise import largest_weights
from spikeport.compile.loihi.row_scales import exponents
from spikeport.compile.passes.base import BlockPass, Context
from spikeport.hardware_models.chip import ChipModel


@dataclass(frozen=True)
class ScaleRows(BlockPass):
    """Scale a compartment's weights, bias and threshold by 2^-k, so that weights survive 8 bits.

    The weights of a block share a scale, so neurons of small gain lose their weights beside
    neurons of large gain. A compartment's input, state and threshold may be scaled together without
    changing when it spikes; powers of two make that exact. Each value of k takes a threshold
    profile of the core.

    A block stays as it is if it learns, is the target of a convolution, has noise or a lower bound
    of the voltage other than zero, or if its current or voltage is read.

    Attributes
    ----------
    profiles : int
        The most thresholds in one block.
    """

    name: ClassVar[str] = "scale_rows"
    profiles: Annotated[int, Field(ge=1)] = 3

    def apply(self, floats: FloatBlocks, context: Context) -> FloatBlocks:
        """Scale the compartments of every block that can be scaled."""
        most = self.most(context.chip)
        read = _read(floats)
        changed = {
            block: k
            for block in floats.blocks
            if block not in read
            and _can_scale(block)
            and (k := exponents(block.compartment, largest_weights(block), most)).any()
        }
        context.note("blocks", {"scaled": len(changed), "of": len(floats.blocks)})
        return floats.with_blocks(
            _scaled(block, changed[block]) if block in changed else block for block in floats.blocks
        )

    def most(self, chip: ChipModel) -> int:
        """Return the most thresholds of a block on a chip."""
        return int(min(self.profiles, chip.limits.most("threshold_profiles")))


def _read(floats: FloatBlocks) -> set[LoihiBlock]:
    """Return the blocks whose current or voltage is read."""
    # The host decodes a state in the units of the compartment as it was built.
    probes = (probe for probe in floats.model.probes if probe.key != "spiked")
    read = {block for probe in probes for block in probe.target}
    pairs = zip(floats.model.blocks, floats.blocks, strict=True)
    return {now for built, now in pairs if built in read}


def _can_scale(block: LoihiBlock) -> bool:
    return not any(synapse.learning or _shifted(synapse) for synapse in block.synapses)


def _shifted(synapse: Synapse) -> bool:
    """Return whether a synapse's indices count from a base, and are not numbers of compartments."""
    bases = synapse.axon_compartment_bases
    return bases is not None and bool(np.any(np.asarray(bases) > 0))


def _scaled(block: LoihiBlock, k: np.ndarray) -> LoihiBlock:
    # Powers of two lose nothing.
    factor = np.exp2(-k).astype(np.float32)
    block = copied(block)
    block.compartment.vth *= factor
    block.compartment.bias *= factor
    for synapse in block.synapses:
        pairs = zip(synapse.weights, synapse.indices, strict=True)
        synapse.weights = [weights * factor[indices] for weights, indices in pairs]
    return block
