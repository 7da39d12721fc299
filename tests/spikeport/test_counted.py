"""Counts in words: a single thing has its singular."""

import pytest

from spikeport.counted import counted


@pytest.mark.parametrize(
    ("n", "expected"), [(0, "0 cores"), (1, "1 core"), (2, "2 cores"), (2306, "2,306 cores")]
)
def test_a_count_has_the_number_of_its_noun(n: int, expected: str) -> None:
    assert counted(n, "core") == expected
