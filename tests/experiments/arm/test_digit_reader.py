import sys

import numpy as np
import pytest

from spikeport.errors import MissingExtraError
from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm.digit_reader import rasterise, read_digit
from spikeport.experiments.arm.strokes import DIGITS, unit_stroke

SIZE = np.array([0.14, 0.20])


@pytest.mark.parametrize("digit", DIGITS)
def test_the_templates_are_read_as_their_digits(digit):
    assert read_digit(unit_stroke(digit) * SIZE) == digit


def test_place_and_size_do_not_matter():
    stroke = unit_stroke(3) * SIZE
    assert np.array_equal(rasterise(stroke), rasterise(5 * stroke + [7.0, -3.0]))


def test_a_picture_is_eight_by_eight_from_0_to_16_and_upright():
    picture = rasterise(unit_stroke(7) * SIZE)
    assert picture.shape == (8, 8)
    assert picture.min() == 0
    assert picture.max() <= 16
    assert picture[0].sum() > 2 * picture[-1].sum() > 0
    assert picture[-1, 4:].sum() < picture[-1, :4].sum() + picture[-1, 4]


def test_a_vertical_line_is_four_cells_wide_in_the_middle():
    line = np.stack([np.zeros(1000), np.linspace(0, 1, 1000)], axis=1)
    picture = rasterise(line)
    assert np.flatnonzero(picture.sum(axis=0)).tolist() == [3, 4]
    assert (picture[1:-1, 3:5] == 8).all()  # two of four columns in each block


def test_the_strokes_are_as_thick_as_those_of_the_data_set():
    from sklearn.datasets import load_digits

    theirs = load_digits().data.sum(axis=1).mean()
    ours = np.mean([rasterise(unit_stroke(digit) * SIZE).sum() for digit in DIGITS])
    assert ours == pytest.approx(theirs, rel=0.2)


def test_a_hand_that_did_not_move_drew_no_digit():
    assert read_digit(np.full((20, 2), 0.3)) is None


def test_a_missing_package_is_named_with_its_extra(monkeypatch):
    monkeypatch.setattr(digit_reader, "find_spec", lambda name: None)
    monkeypatch.setattr(digit_reader, "_reader", digit_reader._reader.__wrapped__)
    assert not digit_reader.can_read()
    with pytest.raises(MissingExtraError) as caught:
        read_digit(unit_stroke(1))
    assert str(caught.value) == (
        "reading digits needs the package scikit-learn, which is absent; "
        "install it with: pip install 'spikeport[digits]'"
    )


def test_a_broken_package_reads_no_digit_and_warns(monkeypatch):
    monkeypatch.setattr(digit_reader, "_reader", digit_reader._reader.__wrapped__)
    monkeypatch.setitem(sys.modules, "sklearn.svm", None)
    with pytest.warns(UserWarning, match="the digit is not read: scikit-learn cannot be imported"):
        assert read_digit(unit_stroke(1)) is None
