"""The rounding of float blocks to integer blocks, with nengo-loihi's discretiser.

Two of its faults are mended here. It scales a group of weights as if the chip had no least
exponent, so that the chip would read weights that need a lower one 2, 4 or more times too large:
here the group has the least exponent, and fewer bits. And it refuses a block whose largest weight
is too small beside its thresholds: here weights take fewer bits until the thresholds fit, and none
at all where they are below the chip's least weight, so that they are 0.
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
from spikeport.compile.ground.notices import warnings_about
from spikeport.compile.ground.quantisation import block_error, block_values
from spikeport.compile.ground.refusal import RefusedError, concerning, refused
from spikeport.compile.image.tables import flat, offsets, parts
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks, copied, copied_probe
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.own_neurons import discretise_own, own_blocks

LEAST_EXPONENT = -6
"""The least exponent e of weights: a weight of m adds m 2^(6 + e) to a current."""
MOST_HALVINGS = 64
"""The most halvings of weights: nengo-loihi itself takes weights of up to 1e-8 as zero."""
TINY = 1e-16
"""A largest weight of a group up to which nengo-loihi takes all of its weights as zero."""


def discretise(floats: FloatBlocks) -> IntegerBlocks:
    """Round every block, and rescale the weights of every probe.

    Raises
    ------
    RefusedError
        If a block holds numbers that are not finite, or no scale fits all of its numbers.
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
        try:
            return discretise_own(block, about[0], own_dt_s)
        except RefusedError as error:
            raise concerning(about, error) from None
    try:
        return _round(block)
    except (NengoException, AssertionError) as error:
        raise refused(about, error, cure_of(error)) from error


def _round(block: LoihiBlock) -> float:
    """Round a block in place, and return the number of the chip's units in a voltage of 1."""
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
    """Join the many rows of a group of synapses in the context, to round their weights at once."""
    weights, indices = synapse.weights, synapse.indices
    synapse.weights = [np.concatenate([row.ravel() for row in weights])[np.newaxis]]
    synapse.indices = [np.concatenate([row.ravel() for row in indices])[np.newaxis]]
    yield
    rounded = parts(offsets(row.size for row in weights), synapse.weights[0][0])
    synapse.weights = [row.reshape(old.shape) for row, old in zip(rounded, weights, strict=True)]
    synapse.indices = indices


def _rounded(compartment: Compartment, largest: float) -> Compartment:
    """Return a rounded compartment that leaves weights of up to ``largest`` the most bits."""
    refusals: list[BuildError] = []
    # Assuming a largest weight twice as large halves the scale: weights have one bit less.
    for halvings in range(MOST_HALVINGS):
        # The discretiser rounds in place, and may have begun before it refuses.
        rounded = copy.deepcopy(compartment)
        try:
            # Looked up in its module, where `numpy1_semantics` replaces it.
            discretize.discretize_compartment(rounded, largest * 2**halvings)
        except BuildError as error:
            refusals.append(error)
        except AssertionError:
            if not refusals:
                raise
            break  # no scale fits all thresholds and biases
        else:
            return rounded
    raise refusals[0]


def scaled_info(
    compartment: Compartment, largest: np.ndarray, k: np.ndarray
) -> Mapping[str, Any] | None:
    """Return the scales that a block is rounded with, if compartments are scaled by 2^-k.

    Parameters
    ----------
    compartment : Compartment
        The compartments of the block, in floating point.
    largest : (n_compartments,) array
        The largest absolute weight into each compartment.
    k : (n_compartments,) array
        The exponents.

    Returns
    -------
    info : mapping or None
        nengo-loihi's ``discretize_info``; None if no scale fits all numbers.
    """
    factor = np.exp2(-k).astype(np.float32)
    compartment = copy.copy(compartment)
    compartment.vth, compartment.bias = compartment.vth * factor, compartment.bias * factor
    try:
        with numpy1_semantics(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rounded = _rounded(compartment, (largest * factor).max(initial=0.0))
    except (BuildError, AssertionError):
        return None
    info: Mapping[str, Any] = rounded.discretize_info
    return info


def stored(weights: np.ndarray, rows: np.ndarray, info: Mapping[str, Any]) -> np.ndarray:
    """Return the weights (n,) of one group into the compartments ``rows``, as the chip has them.

    They are the integers that a block with the scales ``info`` has, divided by these scales.
    """
    if weights.size == 0:
        return weights
    synapse = Synapse(1)
    with numpy1_semantics(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # here nothing is lost yet
        synapse.set_weights(weights[np.newaxis])
        synapse.indices = [rows[np.newaxis]]
        discretize_synapse(synapse, *_scale(synapse, info))
    scale = np.asarray(info["w_scale"])
    scale = scale[rows] if scale.size > 1 else scale
    result: np.ndarray = synapse.weights[0][0] / (scale * SynapseConfig.get_scale(info["w_exp"]))
    return result


def largest_weights(block: LoihiBlock) -> np.ndarray:
    """Return the largest absolute weight into each compartment, (n_compartments,)."""
    largest = np.zeros(block.n_neurons)
    for synapse in block.synapses:
        # A loop over axons would take five times as long.
        weights, indices = (
            flat([one.ravel() for one in of_axons])
            for of_axons in (synapse.weights, synapse.indices)
        )
        # Without this cast, NumPy would cast weights one by one.
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
    # The product of scale and power of two stays the same, at the least exponent.
    return largest, info["w_scale"] * SynapseConfig.get_scale(info["w_exp"]), LEAST_EXPONENT
