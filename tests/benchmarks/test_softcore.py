"""The benchmark of soft cores: times of rows through an SDRAM, and a board that counts rows."""

import numpy as np
import pytest
from softcore import Sdram, SdramChip

from spikeport.backends.native.chip import NativeChip
from tests.helpers.fake_board import small_image

PERIOD, BEFORE = 7.0, 15.0 + 3 * 7.0
"""The time of a word, and the time from the activation of a row to its first word, in ns."""


@pytest.mark.parametrize(
    ("rows", "time_ns"),
    [
        ([(0, 100)], BEFORE + 100 * PERIOD),
        # The second page lies in another bank, and is opened while the first one is read.
        ([(0, 1024)], BEFORE + 1024 * PERIOD),
        # Both lie in bank 0, which opens a row 60 ns after the one before at the earliest.
        ([(0, 1), (4 * 512, 1)], 60 + BEFORE + PERIOD),
        # A refresh every 7812.5 ns: the banks are precharged, refreshed, and opened again.
        ([(0, 1200), (1200, 1)], BEFORE + 1200 * PERIOD + 15 + 15 + 60 + BEFORE + PERIOD),
    ],
)
def test_the_time_of_rows_through_an_sdram(rows: list[tuple[int, int]], time_ns: float) -> None:
    assert Sdram().time_ns(rows) == pytest.approx(time_ns)


def test_a_board_counts_the_rows_of_a_steps_messages(capsys: pytest.CaptureFixture[str]) -> None:
    chip, native = SdramChip(small_image(), 0, first=1), NativeChip(small_image(), 0)
    for spikes in (np.array([0]), np.array([2, 2])):
        for found, expected in zip(chip.step(spikes, {}), native.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(found, expected)
    chip.close()
    printed = capsys.readouterr().out
    # Two messages of one row: two words of header, and three weights.
    assert "messages a step: 2 in the mean, 2 at most\n" in printed
    assert "cycles of the fullest walker: 10 in the mean, 10 at most\n" in printed
