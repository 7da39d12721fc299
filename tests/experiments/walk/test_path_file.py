"""Paths of a user's own, from a file."""

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.walk.paths import find_path


@pytest.fixture
def written(tmp_path):
    """Write a file of a path, and read it for ten seconds."""
    file = tmp_path / "mine.csv"

    def read(*rows, header="t_s,x_m,y_m"):
        file.write_text("\n".join([header, *rows]))
        return find_path(str(file), 0.5, 10.0)

    return read


def test_a_file_has_its_own_times(written):
    path = written("5,0.2,0", "7,1.2,0", "20,1.2,6.5", header="t_s, x_m, y_m")
    assert path.at(1.0) == pytest.approx([0.7, 0, 0.5, 0])
    assert path.at(4.0) == pytest.approx([1.2, 1, 0, 0.5])


def test_a_path_may_stop_and_turn_back(written):
    path = written("0,0,0", "4,2,0", "8,2,0", "20,-3,0")
    assert path.at(6.0) == pytest.approx([2, 0, 0, 0])
    assert path.at(14.0)[2] < 0


TABLE = "expected columns 't_s,x_m,y_m' and two rows or more of rising times, found "
NUMBERS = "times that do not rise, or numbers that are not finite or above 1e+10"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["0,0,0", ""], TABLE + "1 of them; cure: write such a table"),
        (
            ["0,0,0", "20,1"],
            TABLE + "2 cells in line 3; cure: write such a table",
        ),
        (
            ["0,0,0", "20,one,0"],
            TABLE + "a cell that is no number (could not convert string to float: "
            "'one'); cure: write such a table",
        ),
        (
            ["0,0,0", "0,1,0"],
            f"{TABLE}{NUMBERS}; cure: write such a table",
        ),
        (
            ["0,0,0", "20,nan,0"],
            f"{TABLE}{NUMBERS}; cure: write such a table",
        ),
        (
            ["-1e308,0,0", "1e308,1,0"],
            f"{TABLE}{NUMBERS}; cure: write such a table",
        ),
        (
            ["0,0,0", "10001,10001,0"],
            "is 10,001 m long, limit 10,000 m; cure: a shorter path",
        ),
        (
            ["0,3,4", "20,3,5"],
            "begins with a jump of 5.00 m, from the robot at (0, 0) to (3, 4), limit 0.5 m; "
            "cure: begin where it is",
        ),
        (
            ["0,0,0", "4,2,0", "4.5,2,1", "20,3,1"],
            "moves 1.00 m from 4 to 4.5 s, 2.00 m/s, limit 1 m/s, for which the policy is "
            "trained; cure: more time for it",
        ),
        (
            ["0,0,0", "2,1,0", "3,1,0.5", "4,0.5,0.5", "5,0.5,0", "6,1,0", "7,1,0.5", "20,1,5"],
            "turns by 4.71 rad from 2 to 5 s, limit 4 rad in 4 s, 1 rad/s, for which the policy is "
            "trained; cure: more time for it, or wider turns",
        ),
        (
            ["0,0,0", "8,2,0"],
            "lasts 8 s, 10 s are needed, with the lead of the reference; "
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


def test_of_a_long_line_the_begin_is_shown(written):
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
