"""Confidence intervals, compared with published values."""

import numpy as np
import pytest

from spikeport.experiments.evaluate.interval import Interval, of_mean, of_share


def test_the_interval_of_a_share_is_wilsons():
    # Newcombe 1998, Statistics in Medicine 17, table I, method 3: 15 of 148 and 0 of 20
    assert of_share(15, 148) == pytest.approx((0.1014, 0.0624, 0.1605, 148), abs=1e-4)
    assert of_share(0, 20) == pytest.approx((0, 0, 0.1611, 20), abs=1e-4)


def test_the_interval_of_a_mean_is_students():
    mean, low, high, n = of_mean([1.0, 2.0, 3.0])
    half = 4.302653 * 1.0 / np.sqrt(3)  # t of 2 degrees of freedom, 97.5 %
    assert (mean, low, high, n) == pytest.approx((2, 2 - half, 2 + half, 3))
    assert of_mean([1.5]) == Interval(1.5, None, None, 1)
    assert of_mean([]) is None
