r"""Weights and thresholds of a population in units of the chip.

A neuron may have its weights and threshold scaled together. A threshold of nearly :math:`2^p` units
takes as much of the chip's range as fits: a large one keeps more of small weights, which are
multiples of 64 units, and loses less to decays, which are rounded towards zero in every step.

.. math::
    2^p \max(\Sigma^+, \Sigma^-) \le \min(2^{21}, d_u 2^{23}), \qquad 2^p \le 2^{22}

where :math:`\Sigma^\pm` are the sums of a neuron's weights of one sign, in thresholds: no input
wraps a register around, were all sources to spike at once. If at most a share of them does, sums
are that share, and p may grow to 19: the voltage then ends 16 thresholds below zero, or further. So
do sums of more than 128 of the largest weights, of which hardly a bit would be left.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.networks.loading.nir.populations import Population
from spikeport.reading.mismatch import MismatchError

INPUT, CURRENT = 2.0**21, 2.0**23
"""The largest input and current of a step, in units."""
THRESHOLDS = (7, 22)
"""Exponents p of thresholds."""
DEEP = 19
"""The largest p with a voltage that ends 16 thresholds below zero: inhibition adds up."""
UNIT = 64
"""Thresholds are multiples of this."""
LEVELS = 4
"""Different thresholds in a population: a core has eight."""
ONE_WEIGHT = 255 * 2.0**6
"""The largest weight that is one synapse of nengo-loihi; a threshold is no lower than it asks."""

MANTISSA, FINEST, COARSEST = 127, 7, 14
"""A weight is up to 127 times 2^7 to 2^14; a connection has one such step."""


class Units(NamedTuple):
    """A population's weights from each source, constants, (3, n), and threshold, in units."""

    weights: dict[str, sparse.csr_matrix]
    constants: np.ndarray
    threshold: np.ndarray
    at_once: float
    """The share of a neuron's weights that may act in one step; above 1, all may."""


def units(population: Population, n_parts: int, at_once: float = 1.0) -> Units:
    """Return a population in units of the chip, for weights of 1 or 2 synapses.

    ``at_once`` is the largest share of a neuron's sources that spike in one step.

    Raises
    ------
    MismatchError
        A neuron's weights are too many thresholds for a chip of 24 bits.
    """
    of, signal = population.dynamics, population.input
    weights = {name: _rows(of.gain / of.threshold, matrix) for name, matrix in signal.parts.items()}
    constants = population.constants() / of.threshold
    together = sparse.hstack([*weights.values(), sparse.csr_matrix(constants.T)]).tocsr()
    safe = _safe(population, together, n_parts)
    exponents = _exponents(population, together, safe, at_once)
    threshold = np.exp2(exponents) if n_parts > 1 else _full(exponents, together)
    scaled = {name: _rows(threshold, matrix) for name, matrix in weights.items()}
    return Units(scaled, constants * threshold, threshold, float((safe / threshold).min()))


def _rows(scale: np.ndarray, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.diags_array(scale) @ matrix)


def _exponents(
    population: Population, weights: sparse.csr_matrix, safe: np.ndarray, at_once: float
) -> np.ndarray:
    """Return p of each neuron, (n,), by weights in thresholds, and thresholds that are safe."""
    largest = np.abs(weights.data).max(initial=0)
    with np.errstate(divide="ignore"):
        one = MANTISSA * 2.0**COARSEST / largest
        held = np.maximum(safe, ONE_WEIGHT / largest)
        if at_once < 1:
            held = np.maximum(held, np.minimum(held / at_once, 2.0**DEEP))
        found = np.floor(np.log2(np.minimum(held, one)))
    least, most = THRESHOLDS
    if found.min() < least:
        raise MismatchError(
            f"weights of at most {ONE_WEIGHT / 2**least:,.0f} thresholds in node "
            f"{population.node.name}",
            f"{largest:,.6g}",
        )
    capped = np.minimum(found, most)
    result: np.ndarray = np.minimum(capped, capped.min() + LEVELS - 1)
    return result


def _safe(population: Population, weights: sparse.csr_matrix, n_parts: int) -> np.ndarray:
    """Return thresholds, (n,), with which no input wraps around, rounded weights included."""
    above = np.asarray(weights.maximum(0).sum(axis=1)).ravel()
    below = -np.asarray(weights.minimum(0).sum(axis=1)).ravel()
    n_weights = np.diff(weights.indptr)
    rounding = n_weights * np.abs(weights.data).max(initial=0) / MANTISSA**n_parts
    room = np.minimum(INPUT, CURRENT * population.dynamics.current_decay)
    room = np.maximum(room - UNIT * n_weights, room / 2)
    with np.errstate(divide="ignore"):
        result: np.ndarray = room / (np.maximum(above, below) + rounding)
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
    coarse = matrix.copy()
    if most > 1 and step > 2.0**FINEST:
        coarse.data = np.round(matrix.data / step) * step
    for part in (coarse, matrix - coarse):
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
