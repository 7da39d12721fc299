"""Numbers for equal parts of an array."""

import numpy as np

from spikeport.arrays import number_alike


def test_equal_parts_have_equal_numbers() -> None:
    values = np.array([1, 2, 1, 2, 1, 3])
    assert number_alike(values, np.array([0, 2, 4, 5, 6])).tolist() == [0, 0, 1, 2]
    assert number_alike(values, np.array([0, 0, 0])).tolist() == [0, 0]
