"""Lengths and places along curves."""

import numpy as np

from spikeport.experiments.curves import arc_length, interpolated

CORNER = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])


def test_the_arc_length_adds_up_along_a_right_angle():
    assert arc_length(CORNER).tolist() == [0.0, 3.0, 7.0]


def test_places_lie_on_the_curve_and_not_beyond_its_ends():
    found = interpolated(np.array([-1.0, 1.5, 5.0, 9.0]), arc_length(CORNER), CORNER)
    assert found.tolist() == [[0, 0], [1.5, 0], [3, 2], [3, 4]]
