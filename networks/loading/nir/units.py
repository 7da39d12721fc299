r"""Weights and thresholds of a population in units of the chip.

A neuron may have its weights and threshold scaled together. A large threshold keeps more of small
weights, which are multiples of 64 units, and loses less to decays, which are rounded towards zero
in every step. The largest one, :math:`\theta`, is

.. math::
    \theta \max(\Sigma^+, \Sigma^-) \le \min(2^{21}, d_u 2^{23}), \qquad \theta \le 2^{22}

where :math:`\Sigma^\pm` are the sums of a neuron's weights of one sign, in thresholds: no input
wraps a register around, were all sources to spike at once. Where a share of them does at most, sums
are those of so many of its largest weights, and the threshold may grow to 2^19: the voltage then
ends 16 thresholds below zero, or further. In neurons that do not leak, where inhibition adds up, it
always does. Sums are not looked at where they are of more than 128 of the largest weights, of which
hardly a bit would be left.

Where weights then are whole units, thresholds are powers of two, or the graph's own times one; else
the few that let neurons keep most bits.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.constants import DECAY_UNITS
from spikeport.networks.loading.nir.populations import Population
from spikeport.neurons import MANTISSA, UNIT, chip_decays, weight_step
from spikeport.reading.mismatch import MismatchError

INPUT, CURRENT = 2.0**21, 2.0**23
"""The largest input and current of a step, in units."""
THRESHOLDS = (2.0**7, 2.0**22)
DEEP = 2.0**19
"""The largest threshold with a voltage that ends 16 thresholds below zero: inhibition adds up."""
LEVELS, MORE_LEVELS = 4, 8
"""Different thresholds in a population that may share its core, and in one that fills some."""
SHARES = 2**16
"""Weights up to which a population may share its core with another."""
CANDIDATES = 256
"""Thresholds that are tried as levels."""
ONE_WEIGHT = 255 * 2.0**6
"""The largest weight that is one synapse of nengo-loihi; a threshold is no lower than it asks."""

COARSEST = 2.0**14
"""The largest step of a connection's weights, a power of two from `UNIT` on."""


class Units(NamedTuple):
    """A population's weights from each source, constants, (3, n), and threshold, in units.

    Attributes
    ----------
    correction : array
        Correction that the chip is to add to a voltage in each step, (n,), since it rounds the bias
        and its decay.
    at_once : float
        The share of a neuron's weights that may act in one step; above 1, all may.
    """

    weights: dict[str, sparse.csr_matrix]
    constants: np.ndarray
    threshold: np.ndarray
    correction: np.ndarray
    at_once: float


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
    room = _Room(population, weights, constants)
    threshold = _thresholds(room, np.abs(of.threshold), np.abs(of.gain), n_parts, at_once)
    scaled = {name: _rows(threshold, matrix) for name, matrix in weights.items()}
    constants = constants * threshold
    correction = _correction(constants[0], of.current_decay, n_parts)
    share = float((room.inputs(n_parts) / threshold).min())
    return Units(scaled, constants, threshold, correction, share)


def _rows(scale: np.ndarray, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.diags_array(scale) @ matrix)


class _Room:
    """The thresholds that a population's weights, in thresholds, leave in the chip's registers."""

    def __init__(
        self,
        population: Population,
        weights: Mapping[str, sparse.csr_matrix],
        constants: np.ndarray,
    ) -> None:
        self._name, self._of = population.node.name, population.dynamics
        n = population.size
        self._weights = sparse.hstack([sparse.csr_matrix((n, 0)), *weights.values()]).tocsr()
        self._constants = constants
        self.matrix = sparse.hstack([self._weights, sparse.csr_matrix(constants.T)]).tocsr()
        self.largest = np.abs(self.matrix.data).max(initial=0)

    def inputs(self, n_parts: int | None, at_once: float = 1.0) -> np.ndarray:
        """Return thresholds, (n,), with which no input wraps around, once rounded to n_parts."""
        n_weights = np.diff(self.matrix.indptr)
        room = np.minimum(INPUT, CURRENT * self._of.current_decay) - UNIT
        rounding = 0.0
        if n_parts is not None:
            rounding = n_weights * self.largest / MANTISSA**n_parts
            room = np.maximum(room - UNIT * n_weights, room / 2)
        with np.errstate(divide="ignore"):
            result: np.ndarray = room / (np.maximum(*self._sums(at_once)) + rounding)
        return result

    def most(self, n_parts: int | None, at_once: float = 1.0) -> np.ndarray:
        """Return the largest thresholds, (n,), for weights rounded to n_parts, or whole units."""
        with np.errstate(divide="ignore"):
            held = np.maximum(self.inputs(n_parts, at_once), ONE_WEIGHT / self.largest)
            one = MANTISSA * COARSEST / self.largest
        ends = np.minimum(self._deep(n_parts), min(one, THRESHOLDS[1]))
        most: np.ndarray = np.minimum(held, ends)
        if most.min() < THRESHOLDS[0]:
            raise MismatchError(
                f"weights of at most {ONE_WEIGHT / THRESHOLDS[0]:,.0f} thresholds in node "
                f"{self._name}",
                f"{self.largest:,.6g}",
            )
        return most

    def _sums(self, at_once: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the sums of a share of weights, the largest of each sign, and of constants."""
        above, below = (_largest(sign * self._weights, at_once) for sign in (1, -1))
        return (
            above + self._constants.clip(min=0).sum(axis=0),
            below - self._constants.clip(max=0).sum(axis=0),
        )

    def _deep(self, n_parts: int | None) -> np.ndarray:
        """Return thresholds, (n,), with which the voltage ends deep enough for inhibition."""
        _, below = self._sums(1.0)
        endless = (self._of.voltage_decay == 0) & (below > 0)
        result: np.ndarray = np.where(endless, DEEP, np.maximum(DEEP, self.inputs(n_parts)))
        return result


def _largest(matrix: sparse.csr_matrix, share: float) -> np.ndarray:
    """Return the sums, (n,), of a share of each row's entries, the largest above zero."""
    values, n_entries = matrix.data.clip(min=0), np.diff(matrix.indptr)
    row = np.repeat(np.arange(len(n_entries)), n_entries)
    if share < 1:
        values = values[np.lexsort((-values, row))]
        rank = np.arange(len(row)) - matrix.indptr[row]
        values = values * (rank < np.ceil(share * n_entries)[row])
    return np.bincount(row, values, minlength=len(n_entries))


def _thresholds(
    room: _Room, threshold: np.ndarray, gain: np.ndarray, n_parts: int, at_once: float
) -> np.ndarray:
    """Return the thresholds of a population, (n,), by its own ones and its gains."""
    most = room.most(n_parts, at_once)
    if n_parts == 1:
        return _full(_powers(most), room.matrix)
    own = np.divide(threshold, gain, np.ones_like(gain), where=gain > 0)
    for unit in (np.ones_like(own), own):
        found: np.ndarray = unit * np.exp2(_powers(room.most(None, at_once) / unit))
        if len(np.unique(found)) <= LEVELS and _whole(found, room.matrix):
            return found
    return _levels(most, LEVELS if room.matrix.nnz <= SHARES else MORE_LEVELS)


def _powers(most: np.ndarray) -> np.ndarray:
    exponents = np.floor(np.log2(most))
    result: np.ndarray = np.minimum(exponents, exponents.min() + LEVELS - 1)
    return result


def _whole(threshold: np.ndarray, weights: sparse.csr_matrix) -> bool:
    """Return whether thresholds, and weights in them, are whole units."""
    n_units = np.concatenate([threshold, _rows(threshold, weights).data]) / UNIT
    return bool((np.abs(n_units - np.round(n_units)) < 1e-6).all())


def _levels(most: np.ndarray, n_levels: int) -> np.ndarray:
    """Return thresholds of few levels, none above ``most``, with most bits in all."""
    floors = np.floor(most / UNIT) * UNIT
    levels = np.unique(floors)
    if len(levels) > CANDIDATES:
        levels = levels[np.linspace(0, len(levels) - 1, CANDIDATES).astype(int)]
    n_below = np.append(np.searchsorted(np.sort(floors), levels), len(floors))
    # Bits of all neurons from level i on up to level j, if they have level i.
    bits = np.log2(levels)[:, np.newaxis] * (n_below - n_below[:-1, np.newaxis])
    bits[np.tri(*bits.shape) > 0] = -np.inf
    best, following = np.append(np.full(len(levels), -np.inf), 0), []
    for _ in range(n_levels):
        following.append((bits + best).argmax(axis=1))
        best = np.append((bits + best).max(axis=1), 0)
    chosen = [0]
    while (last := following.pop()[chosen[-1]]) < len(levels):
        chosen.append(int(last))
    found: np.ndarray = levels[chosen][np.searchsorted(levels[chosen], floors, "right") - 1]
    return found


def _correction(bias: np.ndarray, current_decay: np.ndarray, n_parts: int) -> np.ndarray:
    """Return what rounding takes off the current that a bias leads to, (n,), in units."""
    rounded = np.zeros_like(bias)
    for part in parts(sparse.csr_matrix(bias[:, np.newaxis]), n_parts):
        step = weight_step(np.abs(part.data).max())
        rounded += np.round(part.toarray().ravel() / step) * step
    decay, _ = chip_decays(current_decay, 0.0)
    result: np.ndarray = np.round(bias / current_decay - rounded / (decay / DECAY_UNITS))
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
    step = weight_step(np.abs(matrix.data).max(initial=0))
    coarse = matrix.copy()
    if most > 1 and step > UNIT:
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
