"""Float blocks -> integer blocks, with nengo-loihi's discretiser."""

import numpy as np
from nengo.exceptions import NengoException
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder.discretize import discretize_block, discretize_probe

from spikeport.compile.check.finite import not_finite
from spikeport.compile.ground.quantisation import block_error, block_values
from spikeport.compile.ground.refusal import collected_warnings, refused, without_addresses
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks, copied, copied_probe
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.own_neurons import discretise_own, own_blocks


def discretise(floats: FloatBlocks) -> IntegerBlocks:
    """Round every block, and scale every probe back.

    Raises
    ------
    RefusedError
        If a block holds numbers that are not finite, or no scale serves all of its numbers.
    """
    blocks = tuple(copied(block) for block in floats.blocks)
    probes = tuple(copied_probe(probe) for probe in floats.model.probes)
    own = own_blocks(floats.model)
    with collected_warnings() as collected, numpy1_semantics():
        pairs = zip(floats.model.blocks, floats.labels, blocks, strict=True)
        scales = {
            built: _discretise(block, label, floats.model.dt if built in own else None)
            for built, label, block in pairs
        }
        for probe in probes:
            for i, block in enumerate(probe.target):
                discretize_probe(probe, i, scales[block])
    errors = tuple(
        block_error(label, block_values(before), after)
        for label, before, after in zip(floats.labels, floats.blocks, blocks, strict=True)
    )
    said = {without_addresses(one.message) for one in collected}
    warnings = tuple(sorted({*floats.warnings, *said}))
    return IntegerBlocks(floats, blocks, probes, errors, warnings)


def _discretise(block: LoihiBlock, label: str, own_dt_s: float | None) -> float:
    values = block_values(block)
    if not all(np.isfinite(part).all() for part in (values.bias, *values.weights)):
        raise not_finite(label, "weights or biases")
    if own_dt_s is not None:
        return discretise_own(block, label, own_dt_s)
    try:
        scale: float = discretize_block(block)
    except (NengoException, AssertionError) as error:
        raise refused(
            label, error, "bring its weights, gains and biases closer together"
        ) from error
    return scale
