"""Float blocks -> integer blocks, with nengo-loihi's discretiser."""

from typing import Any

import numpy as np
from nengo.exceptions import NengoException
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder import Model
from nengo_loihi.builder.discretize import discretize_block, discretize_probe

from spikeport.compile.quantisation import FloatBlock, snapshot
from spikeport.compile.refusal import refused
from spikeport.compile.verdict.finite import not_finite


def discretise(model: Model, labels: dict[Any, str]) -> dict[LoihiBlock, FloatBlock]:
    """Discretise every block and probe of a model in place, inside `numpy1_semantics`.

    Parameters
    ----------
    model : Model
        nengo-loihi's model, built but not discretised.
    labels : dict
        The names of its blocks.

    Returns
    -------
    floats : dict
        The values of each block before.

    Raises
    ------
    RefusedError
        If a block holds numbers that are not finite, or no scale serves all of its numbers.
    """
    floats = {block: snapshot(block) for block in model.blocks}
    scales = {block: _discretise(block, labels[block], floats[block]) for block in model.blocks}
    for probe in model.probes:
        for i, block in enumerate(probe.target):
            discretize_probe(probe, i, scales[block])
    return floats


def _discretise(block: LoihiBlock, label: str, floats: FloatBlock) -> float:
    if not all(np.isfinite(part).all() for part in (floats.bias, *floats.weights)):
        raise not_finite(label, "weights or biases")
    try:
        return discretize_block(block)
    except (NengoException, AssertionError) as error:
        raise refused(
            label, error, "bring its weights, gains and biases closer together"
        ) from error
