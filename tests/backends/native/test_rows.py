"""Rows of weights as spikes add them: split by atom, by ascending target, without hidden ones."""

import numpy as np
import pytest

from spikeport.backends.native.rows import MOST_SHIFT, kept_synapses, rows_of, runs_of
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts


def image_of(*groups: Group, n: int = 9) -> ChipImage:
    return Parts([Block(n)], list(groups)).image()


def test_only_the_last_of_equal_targets_counts() -> None:
    """nengo-loihi's ``q[indices] += weights`` adds the last weight alone."""
    q = np.zeros(9, dtype=int)
    q[[5, 2, 5]] += [64, 128, 192]
    rows = rows_of(image_of(Group([[64, 128, 192]], [[[5, 2, 5]]])))
    assert rows.indices.tolist() == np.flatnonzero(q).tolist() == [2, 5]
    assert rows.weights.tolist() == q[q > 0].tolist() == [128, 192]
    assert rows.start.tolist() == [0, 2]
    assert rows.operations.tolist() == [3]  # the chip reads all three


def test_rows_of_ascending_targets_are_taken_as_they_are() -> None:
    start, kept = kept_synapses(image_of(Group([[64, 64], [64, 64]], [[[3, 4]], [[0, 1]]])))
    assert (start.tolist(), kept) == ([0, 2, 4], slice(None))


def test_atoms_are_rows_of_their_own() -> None:
    group = Group([[[64, 128], [192, 256]], [320]], [[[0, 1], [0, 1]], [[4]]])
    rows = rows_of(image_of(group))
    assert rows.start.tolist() == [0, 2, 4, 5]
    assert rows.operations.tolist() == [2, 2, 1]


@pytest.mark.parametrize(
    ("weights", "shift"),
    [([64, 128], 6), ([64, -32], 5), ([3, 4], 0), ([0, 0], MOST_SHIFT), ([-(2**31)], 31)],
)
def test_a_group_is_shifted_by_the_zero_bits_at_the_end_of_its_weights(
    weights: list[int], shift: int
) -> None:
    assert rows_of(image_of(Group([weights]))).shift.tolist() == [shift]


def test_the_common_shift_is_the_smallest_of_the_groups() -> None:
    rows = rows_of(image_of(Group([[64]]), Group([[48], [32]])))
    assert rows.shift.tolist() == [6, 4, 4]
    assert rows.common_shift == 4


def test_the_common_shift_is_zero_if_a_group_learns() -> None:
    learning = Group([[64] * 9], learning=(1, 4, -7, 10, 8.5, 2, 4))
    assert rows_of(image_of(Group([[64]]), learning)).common_shift == 0


def test_runs_are_stretches_of_consecutive_targets() -> None:
    group = Group([[64] * 5, [64] * 2, [64]], [[[0, 1, 4, 5, 7]], [[8, 3]], [[9]]])
    runs = runs_of(rows_of(image_of(group, n=10)))
    assert runs.start.tolist() == [0, 3, 5, 6]
    # first target, first synapse, size; targets ascend, and no run goes on into the next row
    assert runs.run.tolist() == [[0, 0, 2], [4, 2, 2], [7, 4, 1], [3, 5, 1], [8, 6, 1], [9, 7, 1]]
