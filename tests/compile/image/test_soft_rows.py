"""The memory of rows in a soft core: counted as the writer lays them out, or more than that."""

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.backends.softcore.rows import encoded
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.soft_rows import MOST_GAP, WORD_BITS, row_words, soft_row_bits
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.soft_images import soft_images, wide_image


def by_core(image: ChipImage) -> np.ndarray:
    return np.bincount(image.group_core, soft_row_bits(image), minlength=image.n_cores)


@pytest.mark.slow
@settings(max_examples=100)
@given(image=soft_images())
def test_no_core_takes_more_memory_than_is_counted(image: ChipImage) -> None:
    for counted, core in zip(by_core(image), written(image, unit=0).cores, strict=True):
        assert counted >= WORD_BITS * len(core.rows)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_count_is_at_most_1_percent_too_high_if_no_rows_are_equal(seed: int) -> None:
    image = wide_image(seed)
    rows = [WORD_BITS * len(core.rows) for core in written(image).cores]
    assert (by_core(image) >= rows).all()
    assert by_core(image).sum() < 1.01 * sum(rows)


def counted_words(weights: list[int], indices: list[int] | None = None) -> int:
    """Return the words of one row."""
    at = None if indices is None else [np.array([indices])]
    image = Parts(
        blocks=[Block(n=1000)],
        groups=[Group([weights], at)],
        inputs=[1],
        routes=[Route([0], input=0)],
    ).image()
    return int(soft_row_bits(image).sum()) // WORD_BITS


def test_the_words_of_a_row_agree_with_a_count_by_hand() -> None:
    assert counted_words([64] * 5) == 2 + 3  # two weights a word
    assert counted_words([64, 0, 0, 0, 64]) == 2 + 2  # a word each, with its gap
    assert counted_words([0, 0]) == 0
    assert counted_words([64, 64], [0, 600]) == 2 + 2 + 2  # gaps of up to 255
    assert counted_words([64 * 128]) == 2 + 1  # a shifted weight takes no more bits
    assert counted_words([64 * 129]) == 2 * (2 + 1)  # a weight of 9 bits takes two rows


@pytest.mark.parametrize("seed", range(5))
def test_rows_of_wide_weights_take_the_words_that_are_written(seed: int) -> None:
    """Digits of zero leave gaps: a row that is dense as a whole may not be so in its parts."""
    rng = np.random.RandomState(seed)
    targets = np.sort(rng.choice(400, 100, replace=False)) if seed % 2 else np.arange(100)
    weights = rng.randint(-(2**14), 2**14, 100) << rng.choice([0, 7], 100)
    weights[rng.uniform(size=100) < 0.2] = 0
    (counted,) = row_words(np.zeros(100, dtype=int), targets, weights, 1)
    parts = encoded(0, targets, weights, 0)
    bridges = len(parts) * (np.ptp(targets) // MOST_GAP)  # one for each full gap that may be there
    assert len(parts) > 1
    assert counted - bridges <= sum(map(len, parts)) <= counted
