"""The memory that rows of weights take in a soft core, computed before the rows are written.

A row has a header of two words of 16 bits, then a word for each weight, or a word for two weights
if its targets have hardly any gaps; see ``hardware_models/softcore/walker.v``. Weights of zero are
left out, and weights that need more than 8 bits are split over several rows.
"""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import row_lengths

WORD_BITS, HEADER_WORDS = 16, 2
DENSE_MOST = 1.3
"""A row is stored without gaps if that takes at most this number of entries for each weight: an
entry takes a cycle, and half the memory of an entry with a gap."""
MOST_GAP = 255
WEIGHT_BITS, DIGIT_BITS = 8, 7
"""Bits of a weight in one row, and the bits that each further row adds if weights need more."""


def soft_row_bits(image: ChipImage) -> np.ndarray:
    """Return the bits of each group's rows, (n_groups,): no less than the writer takes.

    The writer stores equal rows of a core once; this count does so only for axons with the same row
    and base.
    """
    words = _row_words(image)
    used = image.in_axons.base >= 0
    reads = np.stack([image.axon_group, image.axon_row, image.in_axons.base])
    distinct = np.unique(reads[:, used], axis=1)
    bits = WORD_BITS * words[distinct[1]]
    return np.bincount(distinct[0], bits, minlength=len(image.groups)).astype(np.int64)


def _row_words(image: ChipImage) -> np.ndarray:
    """Return the words of each row, all its atoms together, (n_rows,)."""
    atoms = image.rows.atoms
    sizes = np.repeat(row_lengths(image), atoms)
    part = np.repeat(np.arange(len(sizes)), sizes)  # of each weight: its row and atom
    index = image.synapses.index.astype(np.int64)
    words = row_words(part, index, image.synapses.weight, len(sizes))
    row = np.repeat(np.arange(len(atoms)), atoms)
    return np.bincount(row, words, minlength=len(atoms)).astype(np.int64)


def row_words(row: np.ndarray, index: np.ndarray, weight: np.ndarray, n_rows: int) -> np.ndarray:
    """Return the words of rows of one atom, (n_rows,).

    Parameters
    ----------
    row, index, weight : arrays of int
        The row, target and weight of each synapse, (n_synapses,).
    n_rows : int
        The number of rows; those without a weight take no words.
    """
    rest = weight.astype(np.int64)
    union, size = (np.zeros(n_rows, dtype=np.int64) for _ in range(2))
    np.bitwise_or.at(union, row, rest)
    np.maximum.at(size, row, np.where(rest < 0, -rest - 1, rest))
    zeros = np.log2(np.maximum(union & -union, 1)).astype(np.int64)
    bits = np.ceil(np.log2((size >> zeros) + 1.0)).astype(np.int64) + 1
    digits = 1 + np.maximum(-(-(bits - WEIGHT_BITS) // DIGIT_BITS), 0)
    rest >>= zeros[row]
    words = np.zeros(n_rows, dtype=np.int64)
    for digit in range(1, int(digits.max(initial=0)) + 1):
        # The last digit of a row has the sign, and all bits above the digits before it.
        entry = np.where(digits[row] == digit, rest, rest & ((1 << DIGIT_BITS) - 1))
        mine = (digits[row] >= digit) & (entry != 0)
        words += _digit_words(row[mine], index[mine], n_rows)
        rest >>= DIGIT_BITS
    return words


def _digit_words(row: np.ndarray, index: np.ndarray, n_rows: int) -> np.ndarray:
    """Return the words of rows with a digit of 8 bits for each of these targets, (n_rows,)."""
    n = np.bincount(row, minlength=n_rows)
    first, last = np.full(n_rows, np.iinfo(np.int64).max), np.full(n_rows, -1)
    np.minimum.at(first, row, index)
    np.maximum.at(last, row, index)
    span = last - first + 1
    dense, sparse = -(-span // 2), n + span // MOST_GAP
    words: np.ndarray = HEADER_WORDS + np.where(span <= DENSE_MOST * n, dense, sparse)
    return np.where(n > 0, words, 0)
