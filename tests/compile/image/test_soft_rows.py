"""The memory of rows in a soft core: counted as the writer lays them out, or more than that."""

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.soft_rows import WORD_BITS, soft_row_bits
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
