"""Float blocks -> integer blocks, with nengo-loihi's discretiser.

Two things are mended around it. A group of weights whose exponent would lie below the chip's least
is multiplied as if it did not, so that the chip would read it 2, 4 or more times too large: here it
keeps the least exponent, and fewer bits. And a block whose largest weight is too small beside its
thresholds is refused: here weights take fewer bits until the thresholds fit, and none at all where
they are less than the chip's least, so that they are 0.
"""

import contextlib
import copy
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from nengo.exceptions import BuildError, NengoException
from nengo_loihi.block import Compartment, LoihiBlock, Synapse, SynapseConfig
from nengo_loihi.builder import discretize
from nengo_loihi.builder.discretize import discretize_probe, discretize_synapse

from spikeport.compile.check.cures import cure_of
from spikeport.compile.check.finite import not_finite
from spikeport.compile.ground.quantisation import block_error, block_values
from spikeport.compile.ground.refusal import refused, warnings_about
from spikeport.compile.image.tables import flat, offsets, parts
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks, copied, copied_probe
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.own_neurons import discretise_own, own_blocks

LEAST_EXPONENT = -6
"""The least exponent of weights: 2^6 is the unit of what they add to a current."""
MOST_HALVINGS = 64
"""The most halvings of weights: nengo-loihi itself takes those of up to 1e-8 as zero."""
TINY = 1e-16
"""A largest weight below which nengo-loihi takes all as zero."""


def discretise(floats: FloatBlocks) -> IntegerBlocks:
    """Round every block, and scale every probe back.

    Raises
    ------
    RefusedError
        If a block holds numbers that are not finite, or no scale serves all of its numbers.
    """
    blocks = tuple(copied(block) for block in floats.blocks)
    probes = tuple(copied_probe(probe) for probe in floats.model.probes)
    own, dt_s = own_blocks(floats.model), floats.model.dt
    scales: dict[LoihiBlock, float] = {}
    with numpy1_semantics():
        for built, entry, block in zip(floats.model.blocks, floats.entries, blocks, strict=True):
            about = (entry.label, *floats.about(entry.owner))
            with warnings_about(entry.label):
                scales[built] = _discretise(block, about, dt_s if built in own else None)
        for probe in probes:
            for i, block in enumerate(probe.target):
                discretize_probe(probe, i, scales[block])
    errors = tuple(
        block_error(label, block_values(before), after)
        for label, before, after in zip(floats.labels, floats.blocks, blocks, strict=True)
    )
    return IntegerBlocks(floats, blocks, probes, errors)


def _discretise(block: LoihiBlock, about: tuple[str, ...], own_dt_s: float | None) -> float:
    values = block_values(block)
    if not all(np.isfinite(part).all() for part in (values.bias, *values.weights)):
        raise not_finite(about[0], "weights or biases")
    if own_dt_s is not None:
        return discretise_own(block, about[0], own_dt_s)
    try:
        return _round(block)
    except (NengoException, AssertionError) as error:
        raise refused(about, error, cure_of(error)) from error


def _round(block: LoihiBlock) -> float:
    """Round a block in place, and return the chip's units in a voltage of 1."""
    largest = max((synapse.max_abs_weight() for synapse in block.synapses), default=0.0)
    block.compartment = _rounded(block.compartment, largest)
    info = block.discretize_info
    for synapse in block.synapses:
        with _as_one_row(synapse):
            discretize_synapse(synapse, *_scale(synapse, info))
    scale: float = info["v_scale"]
    return scale


@contextlib.contextmanager
def _as_one_row(synapse: Synapse) -> Iterator[None]:
    """Join the rows of a group of synapses: each weight is rounded by itself, and rows are many."""
    weights, indices = synapse.weights, synapse.indices
    synapse.weights = [np.concatenate([row.ravel() for row in weights])[np.newaxis]]
    synapse.indices = [np.concatenate([row.ravel() for row in indices])[np.newaxis]]
    yield
    rounded = parts(offsets(row.size for row in weights), synapse.weights[0][0])
    synapse.weights = [row.reshape(old.shape) for row, old in zip(rounded, weights, strict=True)]
    synapse.indices = indices


def _rounded(compartment: Compartment, largest: float) -> Compartment:
    """Return a rounded compartment; weights of at most ``largest`` take all bits that they can."""
    refusals: list[BuildError] = []
    # A largest weight twice as large, by assumption, halves the scale: one bit less for weights.
    for halvings in range(MOST_HALVINGS):
        # The discretiser rounds in place, and may have begun before it refuses.
        rounded = copy.deepcopy(compartment)
        try:
            # By its module's name: `numpy1_semantics` stands another in its place there.
            discretize.discretize_compartment(rounded, largest * 2**halvings)
        except BuildError as error:
            refusals.append(error)
        except AssertionError:
            if not refusals:
                raise
            break  # thresholds and biases alone do not fit beside each other
        else:
            return rounded
    raise refusals[0]


def weight_exponent(block: LoihiBlock, k: np.ndarray) -> float:
    """Return the exponent of the largest weights, if compartments are scaled by 2^-k.

    It is 0, or less where a threshold or a bias leaves weights fewer of their 8 bits, and minus
    infinity where no scale serves all numbers.
    """
    factor = np.exp2(-k).astype(np.float32)
    compartment = copy.copy(block.compartment)
    compartment.vth, compartment.bias = compartment.vth * factor, compartment.bias * factor
    largest = (largest_weights(block) * factor).max(initial=0.0)
    try:
        with numpy1_semantics(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            info = _rounded(compartment, largest).discretize_info
    except (BuildError, AssertionError):
        return -np.inf
    # A largest weight that was taken for a larger one has lost bits, too.
    exponent: float = info["w_exp"] - np.log2(info["w_max"] / largest) if largest else 0.0
    return exponent


def largest_weights(block: LoihiBlock) -> np.ndarray:
    """Return the largest absolute weight into each compartment, (n_compartments,)."""
    largest = np.zeros(block.n_neurons)
    for synapse in block.synapses:
        # Axon by axon it would take five times as long.
        weights, indices = (
            flat([one.ravel() for one in of_axons])
            for of_axons in (synapse.weights, synapse.indices)
        )
        # NumPy would cast weights one by one.
        np.maximum.at(largest, indices, np.abs(weights).astype(largest.dtype))
    return largest


def _scale(synapse: Synapse, info: Mapping[str, Any]) -> tuple[float, np.ndarray, int]:
    """Return the largest weight, scale and exponent that a group of weights is rounded with."""
    whole = info["w_max"], info["w_scale"], info["w_exp"]
    largest = synapse.max_abs_weight()
    # Weights that learn need the block's whole range, which they may grow into.
    if synapse.learning or largest <= TINY:
        return whole
    if info["w_exp"] - int(np.floor(np.log2(info["w_max"] / largest))) >= LEAST_EXPONENT:
        return whole
    # The same products of scale and exponent, at the least exponent.
    return largest, info["w_scale"] * SynapseConfig.get_scale(info["w_exp"]), LEAST_EXPONENT
