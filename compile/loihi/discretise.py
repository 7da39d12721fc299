"""Float blocks -> integer blocks, with nengo-loihi's discretiser."""

import numpy as np
from nengo.exceptions import NengoException
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder.discretize import discretize_block, discretize_probe

from spikeport.compile.check.cures import cure_of
from spikeport.compile.check.finite import not_finite
from spikeport.compile.ground.quantisation import block_error, block_values
from spikeport.compile.ground.refusal import refused, warnings_about
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks, copied, copied_probe
from spikeport.compile.loihi.numpy1 import numpy1_semantics


def discretise(floats: FloatBlocks) -> IntegerBlocks:
    """Round every block, and scale every probe back.

    Raises
    ------
    RefusedError
        If a block holds numbers that are not finite, or no scale serves all of its numbers.
    """
    blocks = tuple(copied(block) for block in floats.blocks)
    probes = tuple(copied_probe(probe) for probe in floats.model.probes)
    scales: dict[LoihiBlock, float] = {}
    with numpy1_semantics():
        for built, entry, block in zip(floats.model.blocks, floats.entries, blocks, strict=True):
            with warnings_about(entry.label):
                scales[built] = _discretise(block, (entry.label, *floats.about(entry.owner)))
        for probe in probes:
            for i, block in enumerate(probe.target):
                discretize_probe(probe, i, scales[block])
    errors = tuple(
        block_error(label, block_values(before), after)
        for label, before, after in zip(floats.labels, floats.blocks, blocks, strict=True)
    )
    return IntegerBlocks(floats, blocks, probes, errors)


def _discretise(block: LoihiBlock, about: tuple[str, ...]) -> float:
    values = block_values(block)
    if not all(np.isfinite(part).all() for part in (values.bias, *values.weights)):
        raise not_finite(about[0], "weights or biases")
    try:
        scale: float = discretize_block(block)
    except (NengoException, AssertionError) as error:
        raise refused(about, error, cure_of(error)) from error
    return scale
