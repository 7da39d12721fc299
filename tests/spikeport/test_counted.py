"""Counts in words: a single thing has its singular."""

import pytest

from spikeport.counted import counted, in_kib, percent


@pytest.mark.parametrize(
    ("n", "expected"), [(0, "0 cores"), (1, "1 core"), (2, "2 cores"), (2306, "2,306 cores")]
)
def test_a_count_has_the_number_of_its_noun(n: int, expected: str) -> None:
    assert counted(n, "core") == expected


@pytest.mark.parametrize(
    ("n_bits", "expected"),
    [(0, "0"), (1, "<1"), (4_095, "<1"), (4_200, "1"), (12_736, "2"), (134_217_728, "16,384")],
)
def test_a_memory_that_is_used_is_not_zero(n_bits: int, expected: str) -> None:
    assert in_kib(n_bits) == expected


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        (0, "0 %"),
        (0.00534, "0.53 %"),
        (0.994, "99 %"),
        (0.9949999, "99 %"),
        (0.996, "100 %"),
        (1, "100 %"),
        (2.456, "246 %"),
        (12.5, "1,250 %"),
        (float("inf"), "inf %"),
        (None, "-"),
    ],
)
def test_a_share_has_two_digits_and_no_exponent(share: float | None, expected: str) -> None:
    assert percent(share) == expected
