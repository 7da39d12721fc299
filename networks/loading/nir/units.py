r"""Weights and thresholds of a population in units of the chip.

A neuron may have its weights and threshold scaled together. A large threshold keeps more bits of
small weights, which are multiples of 64 units, and loses less to decays, which are rounded towards
zero in every step. The largest one, :math:`\theta`, is

.. math::
    \theta \max(\Sigma^+, \Sigma^-) \le \min(2^{21}, d_u 2^{23}), \qquad \theta \le 2^{22}

where :math:`\Sigma^\pm` are the sums of a neuron's weights of one sign, in thresholds: no input
wraps a register around, even if all sources spike at once.

If at most a share ``at_once`` of the sources spikes in a step, the sums are those of that share of
a neuron's weights, the largest ones. The threshold may then exceed the bound for all sources, up to
2^19: the lower end of the voltage, -2^23, is still 16 thresholds below zero. A neuron that does not
leak and has inhibitory input never gets more than 2^19, because its inhibition adds up.

A sum of more than 128.5 times the population's largest weight would leave that weight less than
255 * 2^6 units, the most that one synapse holds. The bound does not apply there, and that weight
keeps 255 * 2^6 units.

If a weight may be two synapses, and all weights and thresholds can be whole units, thresholds are
powers of two, or the graph's own ones, in the unit of its weights, times powers of two. Otherwise a
population has at most 4 levels of thresholds (8 if it is large), chosen to keep the most bits. If a
weight is one synapse, thresholds are powers of two times a common factor, with which the largest
weight takes all bits of its synapse.
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
"""The largest threshold with which the voltage, which ends at -2^23, can fall by 16 thresholds."""
LEVELS, MORE_LEVELS = 4, 8
"""The most different thresholds in a population that may share its core, and in a large one."""
SHARES = 2**16
"""The most weights of a population that may share its core with another."""
CANDIDATES = 256
"""The most thresholds that are tried as levels."""
ONE_WEIGHT = 255 * 2.0**6
"""The largest weight that fits one synapse of nengo-loihi. However large the sums of weights are, a
population's largest weight keeps at least this size."""

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
        A neuron's weights are too large for 24 bits, relative to its threshold, one by one or in
        sum.
    """
    with np.errstate(all="ignore"):  # values that overflow are refused below
        return _units(population, n_parts, at_once)


def _units(population: Population, n_parts: int, at_once: float) -> Units:
    of, signal = population.dynamics, population.input
    weights = {name: _rows(of.gain / of.threshold, matrix) for name, matrix in signal.parts.items()}
    constants = population.constants() / of.threshold
    room = _Room(population, weights, constants)
    threshold = _thresholds(room, np.abs(of.threshold), np.abs(of.gain), n_parts, at_once)
    scaled = {name: _rows(threshold, matrix) for name, matrix in weights.items()}
    constants = constants * threshold
    correction = _correction(constants[0], of.current_decay, n_parts)
    share = float((room.input_bound(n_parts) / threshold).min())
    return Units(scaled, constants, threshold, correction, share)


def _rows(scale: np.ndarray, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.diags_array(scale) @ matrix)


class _Room:
    """Bounds of a population's thresholds, from its weights and the sizes of chip registers."""

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

    def input_bound(self, n_parts: int | None, at_once: float = 1.0) -> np.ndarray:
        """Return the largest thresholds, (n,), with which no input wraps a register around.

        The bounds leave room for weights that ``n_parts`` synapses round up; None is for weights
        that are whole units, which are not rounded.
        """
        n_weights = np.diff(self.matrix.indptr)
        room = np.minimum(INPUT, CURRENT * self._of.current_decay) - UNIT
        rounding = 0.0
        if n_parts is not None:
            rounding = n_weights * self.largest / MANTISSA**n_parts
            room = np.maximum(room - UNIT * n_weights, room / 2)
        with np.errstate(divide="ignore"):
            result: np.ndarray = room / (np.maximum(*self._sums(at_once)) + rounding)
        return result

    def largest_thresholds(self, n_parts: int | None, at_once: float = 1.0) -> np.ndarray:
        """Return the largest thresholds, (n,), with which weights, voltages and inputs fit."""
        with np.errstate(divide="ignore"):
            by_input = np.maximum(self.input_bound(n_parts, at_once), ONE_WEIGHT / self.largest)
            by_weight = MANTISSA * COARSEST / self.largest
        by_register = np.minimum(self._voltage_bound(n_parts), min(by_weight, THRESHOLDS[1]))
        found: np.ndarray = np.minimum(by_input, by_register)
        if found.min() < THRESHOLDS[0]:
            raise MismatchError(
                f"weights of at most {ONE_WEIGHT / THRESHOLDS[0]:g} times the threshold, or sums "
                f"of at most {INPUT / THRESHOLDS[0]:,.0f} times it, in node {self._name}",
                f"{self.largest:,.6g}",
            )
        return found

    def _sums(self, at_once: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the sums of the largest share of weights and of constants, for each sign."""
        above, below = (_largest(sign * self._weights, at_once) for sign in (1, -1))
        return (
            above + self._constants.clip(min=0).sum(axis=0),
            below - self._constants.clip(max=0).sum(axis=0),
        )

    def _voltage_bound(self, n_parts: int | None) -> np.ndarray:
        """Return the largest thresholds, (n,), with which the voltage has room for inhibition."""
        _, below = self._sums(1.0)
        adds_up = (self._of.voltage_decay == 0) & (below > 0)
        result: np.ndarray = np.where(adds_up, DEEP, np.maximum(DEEP, self.input_bound(n_parts)))
        return result


def _largest(matrix: sparse.csr_matrix, share: float) -> np.ndarray:
    """Return the sums, (n,), of the largest share of each row's entries, without negative ones."""
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
    """Return the thresholds of a population, (n,), from its own ones and its gains."""
    largest = room.largest_thresholds(n_parts, at_once)
    if n_parts == 1:
        return _fill_one_synapse(_powers(largest), room.matrix)
    own = np.divide(threshold, gain, np.ones_like(gain), where=gain > 0)
    for unit in (np.ones_like(own), own):
        found: np.ndarray = unit * np.exp2(_powers(room.largest_thresholds(None, at_once) / unit))
        kept = found >= largest / 2**LEVELS  # a far larger threshold would leave others no bits
        if len(np.unique(found)) <= LEVELS and kept.all() and _are_whole_units(found, room.matrix):
            return found
    return _levels(largest, LEVELS if room.matrix.nnz <= SHARES else MORE_LEVELS)


def _powers(largest: np.ndarray) -> np.ndarray:
    """Return exponents of powers of two up to the largest thresholds, with few different ones."""
    exponents = np.floor(np.log2(largest))
    result: np.ndarray = np.minimum(exponents, exponents.min() + LEVELS - 1)
    return result


def _are_whole_units(threshold: np.ndarray, weights: sparse.csr_matrix) -> bool:
    """Return whether thresholds, and weights times thresholds, are whole units."""
    n_units = np.concatenate([threshold, _rows(threshold, weights).data]) / UNIT
    return bool((np.abs(n_units - np.round(n_units)) < 1e-6).all())


def _levels(largest: np.ndarray, n_levels: int) -> np.ndarray:
    """Return thresholds of at most ``n_levels`` levels, within their bounds, with the most bits."""
    floors = np.floor(largest / UNIT) * UNIT
    levels = np.unique(floors)
    if len(levels) > CANDIDATES:
        levels = levels[np.linspace(0, len(levels) - 1, CANDIDATES).astype(int)]
    n_below = np.append(np.searchsorted(np.sort(floors), levels), len(floors))
    # Bits of all neurons from level i up to level j, if level i is their threshold.
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
    """Return the loss by rounding of the current that a bias leads to, (n,), in units."""
    rounded = np.zeros_like(bias)
    for part in parts(sparse.csr_matrix(bias[:, np.newaxis]), n_parts):
        step = weight_step(np.abs(part.data).max())
        rounded += np.round(part.toarray().ravel() / step) * step
    decay, _ = chip_decays(current_decay, 0.0)
    result: np.ndarray = np.round(bias / current_decay - rounded / (decay / DECAY_UNITS))
    return result


def _fill_one_synapse(exponents: np.ndarray, weights: sparse.csr_matrix) -> np.ndarray:
    """Return thresholds, (n,), with which the largest weights take all bits of one synapse.

    The weights share one step, so no row's weights may become larger than the largest.
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
    """Yield the parts of a matrix, which add up to it.

    With ``most`` 1 the only part is the matrix, with ``most`` 2 the parts are its values in 8 bits,
    and the rest, if any. On the chip each part is a connection with a step of its own.
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
    """Yield each part of each matrix, after its source."""
    for name, matrix in weights.items():
        for part in parts(matrix, most):
            yield name, part
