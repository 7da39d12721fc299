"""Paths from a user's own file."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spikeport.errors import UsageError
from spikeport.experiments.walk.path_file import _extremes
from spikeport.experiments.walk.paths import find_path


@pytest.fixture
def written(tmp_path):
    """Return a function that writes the file of a path, and reads it for ten seconds."""
    file = tmp_path / "mine.csv"

    def read(*rows, header="t_s,x_m,y_m"):
        file.write_text("\n".join([header, *rows]))
        return find_path(str(file), 0.5, 10.0)

    return read


def test_the_times_of_a_file_count_from_its_first_row(written):
    path = written("5,0.2,0", "7,1.2,0", "20,1.2,6.5", header="t_s, x_m, y_m")
    assert path.at(1.0) == pytest.approx([0.7, 0, 0.5, 0])
    assert path.at(4.0) == pytest.approx([1.2, 1, 0, 0.5])


def test_a_path_may_stop_and_turn_back(written):
    path = written("0,0,0", "4,2,0", "8,2,0", "20,-3,0")
    assert path.at(6.0) == pytest.approx([2, 0, 0, 0])
    assert path.at(14.0)[2] < 0


def test_a_turn_to_the_other_side_does_not_cancel_a_turn_that_is_too_fast(written):
    """A circle of 0.3 m to the left, and one to the right, each in 2 s: 6 rad, and back."""
    turn = np.linspace(0, 2 * np.pi, 64)
    left = 0.3 * np.stack((np.sin(turn), 1 - np.cos(turn)), axis=1)
    points = np.concatenate([left, (left * (1, -1))[1:]] * 4)
    times = np.linspace(0, 16, len(points))
    rows = [f"{t},{x},{y}" for t, (x, y) in zip(times, points, strict=True)]
    with pytest.raises(UsageError, match=r"turns by 6.*, limit 4 rad in 4 s"):
        written(*rows)


@given(st.lists(st.integers(0, 9), min_size=1, max_size=40), st.randoms(use_true_random=False))
def test_extremes_are_the_maxima_of_each_stretch_of_values(values, random):
    values = np.array(values, dtype=float)
    end = np.array([random.randint(i + 1, len(values)) for i in range(len(values))])
    stretches = [values[i : end[i]] for i in range(len(values))]
    highest = _extremes(values, end, np.maximum)
    np.testing.assert_array_equal(highest, [stretch.max() for stretch in stretches])


TABLE = "expected columns 't_s,x_m,y_m' and two rows or more, found "
NUMBERS = "is not a decimal number from -1e+10 to 1e+10; cure: correct the line"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["0,0,0", ""], TABLE + "1 row; cure: write such a table"),
        (["0,0,0", "20,1"], "line 3: 2 cells, expected 3; cure: correct the line"),
        (["0,0,0", "20,one,0"], f"line 3: x_m 'one' {NUMBERS}"),
        (["0,0,0", "", "20,0, nan"], f"line 4: y_m 'nan' {NUMBERS}"),
        (["0,0,0", "20,-inf,0"], f"line 3: x_m '-inf' {NUMBERS}"),
        (["-1e308,0,0", "1e308,1,0"], f"line 2: t_s '-1e308' {NUMBERS}"),
        (["0,0,0", "1_0,1,0"], f"line 3: t_s '1_0' {NUMBERS}"),
        (["0,0,0", "٢٠,1,0"], f"line 3: t_s '٢٠' {NUMBERS}"),
        (
            ["0,0,0", "3.2,1,0", "3.2,2,0"],
            "line 4: time 3.2 does not follow 3.2; cure: correct the line",
        ),
        (
            ["0,0,0", "10001,10001,0"],
            "is 10,001 m long, limit 10,000 m; cure: a shorter path",
        ),
        (
            ["0,3,4", "20,3,5"],
            "begins with a jump of 5.00 m, from the robot at (0, 0) to (3, 4), limit 0.5 m; "
            "cure: begin at the robot",
        ),
        (
            ["0,0,0", "4,2,0", "4.5,2,1", "20,3,1"],
            "moves 1.00 m from 4 to 4.5 s, 2.00 m/s, limit 1 m/s, for which the policy is "
            "trained; cure: more time for this part",
        ),
        (
            ["0,0,0", "2,1,0", "3,1,0.5", "4,0.5,0.5", "5,0.5,0", "6,1,0", "7,1,0.5", "20,1,5"],
            "turns by 4.71 rad from 2 to 5 s, limit 4 rad in 4 s, 1 rad/s, for which the policy is "
            "trained; cure: more time for this part, or wider turns",
        ),
        (
            ["0,0,0", "8,2,0"],
            "lasts 8 s, but 10 s are needed, including the lead of the reference; "
            "cure: fewer --seconds, or a longer path",
        ),
    ],
)
def test_a_file_that_cannot_be_followed_is_refused(written, tmp_path, rows, message):
    with pytest.raises(UsageError) as caught:
        written(*rows)
    assert str(caught.value) == f"path '{tmp_path / 'mine.csv'}': {message}"


def test_a_file_with_other_columns_is_refused(written, tmp_path):
    with pytest.raises(UsageError) as caught:
        written("0,0,0", "20,1,0", header="x,y,t")
    assert str(caught.value) == (
        f"path '{tmp_path / 'mine.csv'}': {TABLE}columns 'x,y,t'; cure: write such a table"
    )


def test_the_error_of_a_long_line_is_short(written):
    with pytest.raises(UsageError) as caught:
        written(header="x," * 10**6)
    assert len(str(caught.value)) < 1000


def test_a_table_that_would_fill_the_memory_is_refused(written, tmp_path):
    with pytest.raises(UsageError) as caught:
        written(*["0,0,0"] * 10**6)
    assert str(caught.value) == (
        f"path '{tmp_path / 'mine.csv'}': expected a file of at most 4,194,304 bytes, found "
        "6,000,011; cure: write a table as CSV in UTF-8"
    )
