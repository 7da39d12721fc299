"""Angles in rad."""

import numpy as np
import pytest

from spikeport.angles import wrap


def test_wrap_returns_angles_from_minus_pi_to_below_pi():
    assert wrap([np.pi, -np.pi, 3 * np.pi / 2, 0.5]).tolist() == pytest.approx(
        [-np.pi, -np.pi, -np.pi / 2, 0.5]
    )
