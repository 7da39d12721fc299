"""Replays of a record to the host that it was made with, and refusals of other hosts."""

from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.board.board import Board
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.record import Record, SessionRecorder
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.replay import ReplayChip
from spikeport.backends.step_log import KEPT_STEPS, LogOptions
from spikeport.errors import BackendError
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train
from tests.helpers.images import Block, Group, Parts, Route

STEPS = 20


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return the path of a record of `STEPS` steps."""
    made = tmp_path / "record"
    recorded(made, STEPS)
    return made


def recorded(path: Path, steps: int, seed: int = 0) -> None:
    clock = FakeClock()
    line = FakeLine(Board(MACHINE), clock)
    chip = BoardChip(small_image(), 0, line, recorder=SessionRecorder(path), clock=clock)
    for spikes in spike_train(steps, seed):
        chip.step(spikes, {})
    chip.close()


def test_a_host_with_other_spikes_is_refused_at_the_step_that_differs(path: Path) -> None:
    chip = ReplayChip(small_image(), 0, path)
    trains = spike_train(STEPS)
    for spikes in trains[:5]:
        chip.step(spikes, {})
    other = np.setdiff1d(np.arange(5), trains[5])
    with pytest.raises(
        BackendError, match=r"step 6: the host sends \d spikes of source \d, and sent \d then; "
    ):
        chip.step(other, {})


def test_learning_errors_that_were_not_recorded_are_refused(path: Path) -> None:
    learns = Parts(
        [Block(2)],
        [Group([[64] * 2], learning=(1, 1, -7, 10, 2.5, 2, 4))],
        [1],
        [Route([0], input=0)],
    ).image()
    clock, silence = FakeClock(), np.zeros(0, dtype=int)
    other = path.with_name("learns")
    line, recorder = FakeLine(Board(MACHINE), clock), SessionRecorder(other)
    chip = BoardChip(learns, 0, line, recorder=recorder, clock=clock)
    chip.step(silence, {0: np.zeros(1)})
    chip.close()
    with pytest.raises(
        BackendError, match=r"step 1: .* learning errors for synapse groups \[0\] differ"
    ):
        ReplayChip(learns, 0, other).step(silence, {0: np.ones(1)})


def test_input_that_the_image_does_not_have_and_steps_after_the_end_are_refused(path: Path) -> None:
    chip = ReplayChip(small_image(), 0, path)
    with pytest.raises(BackendError, match="synapse group 3 does not learn"):
        chip.step(spike_train(1)[0], {3: np.ones(2)})
    with pytest.raises(BackendError, match="the host's spikes are float64"):
        chip.step(np.array([0.7]), {})
    for spikes in spike_train(STEPS):
        chip.step(spikes, {})
    chip.close()
    with pytest.raises(BackendError, match="closed"):
        chip.step(spike_train(1)[0], {})


def test_a_step_beyond_the_end_of_a_record_is_refused(path: Path) -> None:
    chip = ReplayChip(small_image(), 0, path)
    for spikes in spike_train(STEPS):
        chip.step(spikes, {})
    with pytest.raises(BackendError, match=r"ends after step 20; cure: .*, --seconds 0\.02$"):
        chip.step(np.zeros(0, dtype=int), {})


def test_a_cut_record_plays_up_to_the_cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-190])
    chip = ReplayChip(small_image(), 0, path)
    for spikes in spike_train(STEPS)[:-2]:
        chip.step(spikes, {})
    with pytest.raises(BackendError, match="the record is cut or damaged after step 18"):
        chip.step(np.zeros(0, dtype=int), {})


def test_counts_of_the_first_steps_of_a_record_are_recounted(path: Path) -> None:
    chip, native = ReplayChip(small_image(), 0, path), NativeChip(small_image(), 0)
    for spikes in spike_train(7):
        chip.step(spikes, {})
        native.step(spikes, {})
    check_same_counts(chip, native)
    assert chip.link == {"replays": str(path), "runs": "native", "counted_by": "native"}


def test_counts_of_a_whole_record_are_not_recounted(path: Path, tmp_path: Path) -> None:
    folder = tmp_path / "counts"
    folder.mkdir()
    chip = ReplayChip(small_image(), 0, path, LogOptions(folder=folder))
    for spikes in spike_train(STEPS):
        chip.step(spikes, {})
    chip.close()
    assert (folder / "messages.npz").is_file()
    assert chip.link == {"replays": str(path), "runs": "native"}


def test_an_interrupted_session_is_played_back_with_its_counts(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-190])
    chip, native = ReplayChip(small_image(), 0, path), NativeChip(small_image(), 0)
    for spikes in spike_train(STEPS)[:-2]:
        chip.step(spikes, {})
        native.step(spikes, {})
    check_same_counts(chip, native)


@pytest.mark.slow
def test_counts_just_before_the_log_is_folded_equal_native_counts(tmp_path: Path) -> None:
    recorded(tmp_path / "record", KEPT_STEPS + 1, seed=2)
    chip = ReplayChip(small_image(), 0, tmp_path / "record")
    native = NativeChip(small_image(), 0)
    trains = spike_train(KEPT_STEPS - 1, seed=2)
    assert trains[-1].size  # their messages count in the step after
    for spikes in trains:
        chip.step(spikes, {})
        native.step(spikes, {})
    check_same_counts(chip, native)


def check_same_counts(chip: ReplayChip, native: NativeChip) -> None:
    found, expected = chip.activity(), native.activity()
    assert found.totals() == expected.totals()
    assert found.readout_spikes == expected.readout_spikes
    np.testing.assert_array_equal(found.messages, expected.messages)
    np.testing.assert_array_equal(found.messages_host, expected.messages_host)


def test_closing_closes_the_record_even_if_its_counts_cannot_be_written(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise BackendError("no counts")

    closed: list[Record] = []
    monkeypatch.setattr(Record, "close", lambda self: closed.append(self))
    monkeypatch.setattr("spikeport.backends.replay.recounted", refused)
    (tmp_path / "counts").mkdir()
    chip = ReplayChip(small_image(), 0, path, LogOptions(folder=tmp_path / "counts"))
    chip.step(spike_train(1)[0], {})
    with pytest.raises(BackendError, match="no counts"):
        chip.close()
    assert len(closed) == 1


def test_a_record_of_another_image_is_refused(path: Path) -> None:
    with pytest.raises(BackendError, match=r"a record of image .*, but the network is image"):
        ReplayChip(Parts(inputs=[5]).image(), 0, path)


def test_a_record_of_another_seed_is_refused_and_closed(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[Record] = []
    monkeypatch.setattr(Record, "close", lambda self: closed.append(self))
    with pytest.raises(BackendError, match="of seed 0, but the run has seed 3; cure: --seed 0"):
        ReplayChip(small_image(), 3, path)
    assert len(closed) == 1


def test_a_source_that_spikes_more_often_than_recorded_is_named(path: Path) -> None:
    chip, trains = ReplayChip(small_image(), 0, path), spike_train(STEPS)
    at = next(i for i, spikes in enumerate(trains) if spikes.size)
    for spikes in trains[:at]:
        chip.step(spikes, {})
    source = trains[at][0]
    with pytest.raises(BackendError) as caught:
        chip.step(np.append(trains[at], source), {})
    expected = f"the host sends 2 spikes of source {source}, and sent 1 then; 1 sources differ"
    assert expected in str(caught.value)
