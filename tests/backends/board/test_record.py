"""Records of sessions, whole or read up to a cut or a damage."""

import errno
import os
import random
from pathlib import Path

import pytest

from spikeport.backends.board.board import Board
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.record import FLUSH_S, Record, SessionRecorder
from spikeport.errors import BackendError, UsageError
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train

STEPS = 30


@pytest.fixture
def content(tmp_path: Path) -> bytes:
    """Return the bytes of a record of `STEPS` steps."""
    path = tmp_path / "good"
    clock = FakeClock()
    chip = BoardChip(
        small_image(),
        3,
        FakeLine(Board(MACHINE), clock),
        recorder=SessionRecorder(path),
        clock=clock,
    )
    for spikes in spike_train(STEPS):
        chip.step(spikes, {})
    chip.close()
    return path.read_bytes()


def test_a_whole_record_has_session_steps_and_totals(tmp_path: Path, content: bytes) -> None:
    record = Record(tmp_path / "good")
    assert record.session.digest == small_image().digest
    assert (record.session.seed, record.session.runs) == (3, "native")
    steps = list(record.steps())
    assert [step.board_step for step in steps] == list(range(1, STEPS + 1))
    assert record.whole
    assert record.totals is not None


def test_any_cut_leaves_the_whole_steps_before_it(tmp_path: Path, content: bytes) -> None:
    path, before = tmp_path / "cut", 0
    first = len(content) - len(content.split(b"steps_per_s", 1)[1]) + 40
    for end in range(first, len(content), 37):
        path.write_bytes(content[:end])
        record = Record(path)
        steps = [step.board_step for step in record.steps()]
        assert steps == list(range(1, len(steps) + 1))
        assert len(steps) >= before
        before = len(steps)
    assert before == STEPS


def test_a_damaged_step_ends_the_record(tmp_path: Path, content: bytes) -> None:
    rng, path = random.Random(0), tmp_path / "damaged"
    for _ in range(50):
        data, at = bytearray(content), rng.randrange(len(content) // 2, len(content))
        path.write_bytes(data[:at])
        before = len(list(Record(path).steps()))
        data[at] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        record = Record(path)
        steps = [step.board_step for step in record.steps()]
        assert steps == list(range(1, len(steps) + 1))
        assert len(steps) >= before > 0
        assert not record.whole or record.totals is None


def test_a_killed_host_leaves_a_record_of_all_but_its_last_moments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, now_s = tmp_path / "killed", [50.0]
    monkeypatch.setattr("spikeport.backends.board.record.time.monotonic", lambda: now_s[0])
    recorder = SessionRecorder(path)
    recorder.begin(Hello("digest", 3), Welcome("digest", "native", 1e4))
    left = []
    for step in range(1, 6):
        # A reader finds before each step the same as a host that is killed then has left.
        left.append(len(list(Record(path).steps())))
        now_s[0] += 0.6 * FLUSH_S
        recorder.step(step, 0, b"", b"answer")
    assert left == [0, 0, 2, 2, 4]
    recorder.close()


@pytest.mark.parametrize("wrong", [b"", b"SPKLREC1", b"other"])
def test_files_that_are_not_records_are_refused(tmp_path: Path, wrong: bytes) -> None:
    path = tmp_path / "other"
    path.write_bytes(wrong)
    with pytest.raises(UsageError, match=f"{path}: no record of a board's session"):
        Record(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="missing: no such file"):
        Record(tmp_path / "missing")


def test_a_pipe_which_nobody_writes_into_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(UsageError, match="pipe: expected a file, found a pipe or a device"):
        Record(tmp_path / "pipe")


def test_an_earlier_record_stays_until_there_is_a_session(tmp_path: Path, content: bytes) -> None:
    recorder = SessionRecorder(tmp_path / "good")
    recorder.discard()
    assert (tmp_path / "good").read_bytes() == content
    recorder = SessionRecorder(tmp_path / "good")
    recorder.begin(Hello("digest", 4), Welcome("digest", "native", 1e4))
    assert Record(tmp_path / "good").session.seed == 4
    recorder.discard()
    assert not (tmp_path / "good").exists()


def test_two_sessions_are_not_recorded_in_one_file(tmp_path: Path) -> None:
    path = tmp_path / "record"
    first = SessionRecorder(path)
    with pytest.raises(UsageError) as caught:
        SessionRecorder(path)
    assert str(caught.value) == (
        f"--record {path}: another session is recorded in it; choose another file"
    )
    first.begin(Hello("digest", 3), Welcome("digest", "native", 1e4))
    first.close()
    assert Record(path).session.seed == 3
    SessionRecorder(path).close()


def test_a_record_whose_steps_go_back_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "record"
    recorder = SessionRecorder(path)
    recorder.begin(Hello("digest", 3), Welcome("digest", "native", 1e4))
    for step in (1, 2, 2, 1):  # a late board is in one step twice
        recorder.step(step, 0, b"", b"answer")
    recorder.close()
    record = Record(path)
    with pytest.raises(BackendError, match="step 1 after step 2: several sessions in one file"):
        list(record.steps())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_full_disk_is_reported_with_the_record_s_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spikeport.backends.board.record._may_be_replaced", lambda _: True)
    recorder = SessionRecorder(Path("/dev/full"))
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        recorder.step(1, 0, b"", b"answer")
    with pytest.raises(OSError, match="No space left on device"):
        recorder.close()


@pytest.mark.parametrize("kind", ["a device", "a pipe", "a model"])
def test_a_path_that_is_no_record_is_refused_and_left_as_it_is(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "model.py"
    match kind:
        case "a device":
            path.symlink_to("/dev/null")
        case "a pipe":
            os.mkfifo(path)
        case _:
            path.write_text("import nengo")
    before = os.lstat(path)
    with pytest.raises(UsageError, match=r"model.py: is not a record, and would be replaced; "):
        SessionRecorder(path)
    assert os.lstat(path) == before


def test_a_record_that_cannot_be_begun_leaves_an_earlier_one(
    tmp_path: Path, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.rec"
    path.write_bytes(content)
    recorder = SessionRecorder(path)

    def fail(_size: int) -> int:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(recorder._file, "truncate", fail, raising=False)
    with pytest.raises(OSError, match="Input/output"):
        recorder.begin(Hello("digest", 4), Welcome("digest", "native", 1e4))
    recorder.discard()
    assert path.read_bytes() == content
