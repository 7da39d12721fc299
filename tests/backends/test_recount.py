"""Totals of a record that has none, recounted by a native chip that answers like the board."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.board.board import Board, Machine
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.timing import RealTime
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.recount import recounted
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train

STEPS = 20


class OtherChip(NativeChip):
    """A chip that loses the host's spikes after its first ten steps."""

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Step, and lose the host's spikes once ten steps were made."""
        late = len(self.log.activity().spikes) >= STEPS // 2
        return super().step(spikes[:0] if late else spikes, errors)


def recorded(
    path: Path, machine: Machine = MACHINE, faults: tuple[str, ...] = (), period_s: float = 0.001
) -> BoardChip:
    """Record a session in real time, and return its chip."""
    clock = FakeClock()
    line = FakeLine(Board(machine), clock, faults)
    timing = RealTime(period_s)
    recorder = SessionRecorder(path)
    chip = BoardChip(small_image(), 0, line, timing, recorder=recorder, clock=clock)
    for spikes in spike_train(STEPS):
        chip.step(spikes, {})
    chip.close()
    return chip


def test_recounted_totals_equal_the_boards_although_it_missed_steps(tmp_path: Path) -> None:
    chip = recorded(tmp_path / "record", faults=("slow=2.5@5",))
    assert chip.figures.held == 2
    board, found = chip.activity(), recounted(small_image(), tmp_path / "record", STEPS)
    assert found.readout_spikes == board.readout_spikes
    np.testing.assert_array_equal(found.messages.between, board.messages)
    np.testing.assert_array_equal(found.messages.from_host, board.messages_host)


def test_a_record_with_answers_other_than_the_native_chips_is_not_recounted(tmp_path: Path) -> None:
    def other(image: ChipImage, seed: int) -> NativeChip:
        return OtherChip(image, seed)

    path = tmp_path / "record"
    recorded(path, Machine("other", other))
    recounted(small_image(), path, STEPS // 2)
    says = (
        r"record: the record has no counts after step 20, and the native chip cannot recount them: "
        r"its answer to step 1\d differs from the board's; cure: record a session that is not "
        r"interrupted, and replay it to its end$"
    )
    with pytest.raises(BackendError, match=says):
        recounted(small_image(), path, STEPS)
