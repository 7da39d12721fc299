"""The start of a stub, and its end without a process or a file left."""

import tempfile
from pathlib import Path

import pytest

from spikeport.backends.board.stub import Stub
from spikeport.child import Child
from spikeport.errors import BackendError, UsageError


def test_a_stub_that_cannot_start_says_why() -> None:
    with pytest.raises(BackendError, match="did not start: error: --fault 'nonsense'"):
        Stub(["nonsense"])


def test_a_temporary_folder_with_a_long_path_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    with pytest.raises(UsageError, match=r"limit 107; choose a shorter one, as by TMPDIR=/tmp$"):
        Stub()
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_a_stub_that_was_never_used_is_stopped_and_leaves_no_process_and_no_folder(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("spikeport.child.STOP_S", 0.2)
    stub = Stub()
    assert stub.address.path is not None
    folder = stub.address.path.parent
    process = Path(f"/proc/{stub.process_id}")
    assert folder.exists()
    assert process.exists()
    stub.close()
    assert not folder.exists()
    assert not process.exists()


def test_the_warnings_of_a_chip_are_passed_on_as_the_stub_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    words = "board: waits\nwarning: Received PES error beyond the chip's\nboard: 3 steps"
    monkeypatch.setattr(Child, "__init__", lambda *_: None)
    monkeypatch.setattr(Child, "close", lambda _: words)
    stub = Stub()
    with pytest.warns(UserWarning, match=r"^on the board: Received PES error beyond") as caught:
        stub.close()
    assert len(caught) == 1
