"""Rows of weights of a soft core: 16-bit words, see ``hardware_models/softcore/walker.v``.

word 0  {shift 5, dense 1, entries - 1 10},  word 1  first target
sparse  {gap 8, weight 8},                   dense   {weight 8, weight 8}, the low byte first
"""

from collections.abc import Iterator

import numpy as np

from spikeport.backends.softcore.memory import wrapped
from spikeport.compile.image.manifest import SUM_BITS
from spikeport.compile.image.soft_rows import DENSE_MOST, DIGIT_BITS, MOST_GAP, WEIGHT_BITS


def encoded(first: int, targets: np.ndarray, weights: np.ndarray, unit: int) -> list[np.ndarray]:
    """Return the rows that add weights to compartments of a core; none if all weights are zero.

        sum of rows of (entry 2^(shift + unit)) = weight   modulo 2^22

    Parameters
    ----------
    first : int
        The compartment that targets count from.
    targets, weights : (n,) int array
        Targets, ascending, and their weights, multiples of 2^unit.
    unit : int
        Sums are in units of 2^unit.
    """
    weights = wrapped(weights, SUM_BITS) >> unit
    kept = weights != 0
    return [_row(first, targets[kept], *part) for part in _parts(weights[kept])]


def _parts(weights: np.ndarray) -> Iterator[tuple[np.ndarray, int]]:
    """Yield parts of 8-bit weights, each with a shift; their sum is the weights."""
    if not len(weights):
        return
    union = int(np.bitwise_or.reduce(weights))
    # The number of zero bits at the end of all weights.
    shift = (union & -union).bit_length() - 1
    weights = weights >> shift
    half = 1 << (WEIGHT_BITS - 1)
    # Low digits first, without sign; the last part has the sign.
    while weights.min() < -half or weights.max() >= half:
        low = weights & ((1 << DIGIT_BITS) - 1)
        if low.any():
            yield low, shift
        weights, shift = weights >> DIGIT_BITS, shift + DIGIT_BITS
    yield weights, shift


def _row(first: int, targets: np.ndarray, weights: np.ndarray, shift: int) -> np.ndarray:
    """Return the words of a row, without the weights that are zero in this part."""
    kept = weights != 0
    targets, octets = targets[kept].astype(np.int64), weights[kept] & 0xFF
    span = int(targets[-1] - targets[0]) + 1
    # A dense entry has no gap and takes half a word, so a dense row pays even with holes.
    is_dense = span <= DENSE_MOST * len(targets)
    words = _dense(targets, octets, span) if is_dense else _sparse(targets, octets)
    entries = span if is_dense else len(words)
    header = [shift << 11 | int(is_dense) << 10 | (entries - 1), first + int(targets[0])]
    return np.concatenate([header, words]).astype(np.uint16)


def _dense(targets: np.ndarray, octets: np.ndarray, span: int) -> np.ndarray:
    pairs = np.zeros(-(-span // 2) * 2, dtype=np.int64)
    pairs[targets - targets[0]] = octets
    words: np.ndarray = pairs[0::2] | pairs[1::2] << 8
    return words


def _sparse(targets: np.ndarray, octets: np.ndarray) -> np.ndarray:
    """Return entries with gaps; entries of weight 0 bridge a gap of more than 8 bits."""
    gaps = np.diff(targets, prepend=targets[0])
    before = np.maximum(gaps - 1, 0) // MOST_GAP
    words = np.full(len(targets) + int(before.sum()), MOST_GAP << 8, dtype=np.int64)
    words[np.arange(len(targets)) + np.cumsum(before)] = (gaps - before * MOST_GAP) << 8 | octets
    return words
