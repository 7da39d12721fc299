r"""Weights and thresholds of a population in units of the chip.

A neuron may have its weights and threshold scaled together. A threshold of nearly :math:`2^p` units
takes as much of the chip's range as fits: a large one keeps more of small weights, which are
multiples of 64 units, and loses less to decays, which are rounded towards zero in every step.

.. math::
    2^p \max(\Sigma^+, \Sigma^-) \le \min(2^{21}, d_u 2^{23}), \qquad 2^p \le 2^{22}

where :math:`\Sigma^\pm` are the sums of a neuron's weights of one sign, in thresholds: no input
wraps a register around, were all sources to spike at once. Where a share of them does at most, sums
are that share, and p may grow to 19: the voltage then ends 16 thresholds below zero, or further.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.networks.loading.nir.populations import Population
from spikeport.neurons import integrals
from spikeport.reading.mismatch import MismatchError

INPUT, CURRENT = 2.0**21, 2.0**23
"""The largest input and current of a step, in units."""
THRESHOLDS = (7, 22)
"""Exponents p of thresholds."""
DEEP = 19
"""The largest p with a voltage that ends 16 thresholds below zero: inhibition adds up."""
UNIT = 64
"""Thresholds are multiples of this."""
LEAK = 2.0**18
"""The most that a step may add to a voltage."""
LEVELS = 4
"""Different thresholds in a population: a core has eight."""
ONE_WEIGHT = 255 * 2.0**6
"""The largest weight that is one synapse of nengo-loihi; a threshold is no lower than it asks."""

MANTISSA, FINEST, COARSEST = 127, 7, 14
"""A weight is up to 127 times 2^7 to 2^14; a connection has one such step."""


class Units(NamedTuple):
    """A population's weights from each source, its bias, leak and threshold, in units."""

    weights: dict[str, sparse.csr_matrix]
    bias: np.ndarray
    leak: np.ndarray
    threshold: np.ndarray


def units(population: Population, n_parts: int, at_once: float = 1.0) -> Units:
    """Return a population in units of the chip, for weights of 1 or 2 synapses.

    ``at_once`` is the largest share of a neuron's sources that spike in one step.

    Raises
    ------
    MismatchError
        A neuron's weights are too many thresholds for a chip of 24 bits.
    """
    of, signal = population.dynamics, population.input
    per_threshold = of.gain / of.threshold
    weights = {name: _rows(per_threshold, matrix) for name, matrix in signal.parts.items()}
    bias, leak = per_threshold * signal.constant, of.leak / of.threshold
    if (of.current_decay == 1).all():
        bias, leak = bias + leak, leak * 0  # without a filter, both are the same
    together = sparse.hstack([*weights.values(), sparse.csr_matrix(bias[:, np.newaxis])]).tocsr()
    # The chip lowers thresholds by what its decays take away; here weights are raised by it.
    current, voltage = integrals(of.current_decay, of.voltage_decay)
    raised = _rows(current * voltage, together)
    exponents = _exponents(population, raised, leak, at_once)
    threshold = np.exp2(exponents) if n_parts > 1 else _full(exponents, raised)
    scale = threshold * current * voltage
    scaled = {name: _rows(scale, matrix) for name, matrix in weights.items()}
    return Units(scaled, bias * scale, leak * scale, scale)


def _rows(scale: np.ndarray, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.diags_array(scale) @ matrix)


def _exponents(
    population: Population, weights: sparse.csr_matrix, leak: np.ndarray, at_once: float
) -> np.ndarray:
    """Return p of each neuron, (n,), by weights in thresholds."""
    above = np.asarray(weights.maximum(0).sum(axis=1)).ravel()
    below = -np.asarray(weights.minimum(0).sum(axis=1)).ravel()
    room = np.minimum(INPUT, CURRENT * population.dynamics.current_decay)
    largest = np.abs(weights.data).max(initial=0)
    with np.errstate(divide="ignore"):
        safe = np.maximum(room / np.maximum(above, below), ONE_WEIGHT / largest)
        if at_once < 1:
            held = np.minimum(MANTISSA * 2.0**COARSEST / largest, 2.0**DEEP)
            safe = np.maximum(safe, np.minimum(safe / at_once, held))
        found = np.floor(np.log2(np.minimum(safe, LEAK / np.abs(leak))))
    least, most = THRESHOLDS
    if found.min() < least:
        raise MismatchError(
            f"weights of at most {ONE_WEIGHT / 2**least:,.0f} thresholds in node "
            f"{population.node.name}",
            f"{largest:,.0f}",
        )
    capped = np.minimum(found, most)
    result: np.ndarray = np.minimum(capped, capped.min() + LEVELS - 1)
    return result


def _full(exponents: np.ndarray, weights: sparse.csr_matrix) -> np.ndarray:
    """Return thresholds, (n,), with which the largest weights take all bits of one synapse.

    Since all weights share one step, no row's become larger than the largest are.
    """
    flat: np.ndarray = np.exp2(exponents)
    rows = abs(weights).max(axis=1).toarray().ravel()
    lowest, largest = 2.0 ** exponents.min(), rows.max(initial=0)
    if largest == 0:
        return flat
    with np.errstate(divide="ignore"):
        raised = np.clip(np.floor(np.log2(largest / rows)), 0, exponents - exponents.min())
    share = MANTISSA / (largest * lowest)
    share *= 2.0 ** np.floor(np.log2(1 / share))
    result: np.ndarray = np.exp2(raised) * max(np.floor(share * lowest / UNIT), 1) * UNIT
    return result


def parts(matrix: sparse.csr_matrix, most: int) -> Iterator[sparse.csr_matrix]:
    """Yield a matrix, or with ``most`` 2, what 8 bits hold of it, and the rest if any.

    On the chip each part is a connection with a step of its own.
    """
    largest = np.abs(matrix.data).max(initial=0)
    step = 2.0 ** np.ceil(np.log2(max(largest / MANTISSA, 2.0**FINEST)))
    if most == 1 or step == 2.0**FINEST:
        yield matrix
        return
    coarse = matrix.copy()
    coarse.data = np.round(matrix.data / step) * step
    fine = matrix - coarse
    for part in (coarse, fine):
        part.eliminate_zeros()
        if part.nnz:
            yield part


def all_parts(
    weights: Mapping[str, sparse.csr_matrix], most: int
) -> Iterator[tuple[str, sparse.csr_matrix]]:
    """Yield each source and part."""
    for name, matrix in weights.items():
        for part in parts(matrix, most):
            yield name, part
