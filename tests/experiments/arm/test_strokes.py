import numpy as np
import pytest

from spikeport.experiments.arm.strokes import DIGITS, unit_stroke
from spikeport.experiments.curves import arc_length


def starts_and_ends(digit):
    return unit_stroke(digit)[[0, -1]].round(2).tolist()


@pytest.fixture(params=DIGITS)
def stroke(request):
    return unit_stroke(request.param)


def test_there_are_ten_digits():
    assert DIGITS == (0, 1, 2, 3, 4, 5, 6, 7, 8, 9)


def test_a_stroke_fills_the_box_from_bottom_to_top(stroke):
    assert stroke.min() == pytest.approx(0, abs=0.02)
    assert stroke.max() == pytest.approx(1, abs=0.02)
    assert stroke[:, 1].min() == pytest.approx(0, abs=0.02)
    assert stroke[:, 1].max() == pytest.approx(1, abs=0.02)


def test_a_stroke_is_sampled_finely(stroke):
    steps = np.diff(arc_length(stroke))
    assert steps.min() > 0
    assert steps.max() < 0.005


def test_a_stroke_turns_nowhere_abruptly(stroke):
    along = np.diff(stroke, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    turns_deg = np.degrees(np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1, 1)))
    assert turns_deg.max() < 10


@pytest.mark.parametrize("digit", [0, 8])
def test_closed_digits_end_where_they_begin(digit):
    start, end = starts_and_ends(digit)
    assert start == end


# A mirrored digit has its ends, or its belly, on the other side.


def test_digits_are_not_mirrored():
    assert starts_and_ends(2)[1][0] > 0.9  # the foot of 2 ends right
    assert starts_and_ends(5)[0][0] > 0.8  # the bar of 5 begins right
    assert starts_and_ends(7)[0][0] < 0.1  # the bar of 7 begins left
    for digit in (3, 5):  # lower bellies to the right
        lower = unit_stroke(digit)[unit_stroke(digit)[:, 1] < 0.4]
        assert (lower[:, 0] > 0.5).mean() > 0.5
    assert starts_and_ends(6)[0][0] > 0.5 > starts_and_ends(6)[1][0]
    assert starts_and_ends(9)[0][0] > 0.5


def test_digits_are_not_upside_down():
    assert starts_and_ends(7)[0][1] > 0.9
    assert starts_and_ends(1)[1] == pytest.approx([0.61, 0.0])
    upper, lower = (np.ptp(unit_stroke(8)[half, 0]) for half in _halves(unit_stroke(8)))
    assert upper < lower


def _halves(stroke):
    return stroke[:, 1] > 0.6, stroke[:, 1] < 0.4
