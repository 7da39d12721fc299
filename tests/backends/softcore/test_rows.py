"""Rows of weights in words of 16 bits, there and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.backends.softcore.memory import wrapped
from spikeport.backends.softcore.rows import encoded
from spikeport.compile.image.manifest import SUM_BITS
from tests.helpers.softcore_integers import decoded

N = 1024


def summed(rows: list[np.ndarray], unit: int) -> np.ndarray:
    total = np.zeros(N, dtype=np.int64)
    for words in rows:
        targets, weights = decoded(words, 0, unit)
        np.add.at(total, targets, weights)
    return wrapped(total, SUM_BITS)


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 300), size=st.integers(1, 30))
def test_rows_add_up_to_their_weights(seed: int, n: int, size: int) -> None:
    rng = np.random.RandomState(seed)
    targets = np.sort(rng.choice(rng.randint(n, N + 1), n, replace=False))
    weights = rng.randint(-(2**size), 2**size, n)
    expected = np.zeros(N, dtype=np.int64)
    expected[targets] = wrapped(weights, SUM_BITS)
    np.testing.assert_array_equal(summed(encoded(0, targets, weights, 0), 0), expected)


def test_weights_of_8_bits_are_one_row_whatever_their_shift() -> None:
    targets, weights = np.arange(5), np.array([-128, 127, 0, 1, -1]) << 6
    (words,) = encoded(100, targets, weights, unit=6)
    assert words.tolist() == [1 << 10 | 4, 100, 0x7F80, 0x0100, 0x00FF]


def test_a_wide_gap_is_bridged_by_entries_of_weight_zero() -> None:
    (words,) = encoded(0, np.array([3, 600]), np.array([1, 2]), unit=0)
    assert words.tolist() == [3, 3, 1, 255 << 8, 255 << 8, 87 << 8 | 2]


@pytest.mark.parametrize("weights", [[0, 0], [2**22, -(2**22)]])
def test_weights_that_add_nothing_give_no_row(weights: list[int]) -> None:
    assert encoded(0, np.arange(2), np.array(weights), unit=0) == []


def test_weights_of_more_than_8_bits_are_split_into_rows() -> None:
    rows = encoded(0, np.arange(2), np.array([2**20 + 1, -(2**20)]), unit=0)
    assert len(rows) == 2  # no bit between these is set
    assert summed(rows, 0)[:2].tolist() == [2**20 + 1, -(2**20)]
