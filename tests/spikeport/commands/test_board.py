"""`board serve` and `board inspect` as commands."""

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spikeport.backends.board.board import Board
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.messages import Codec
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.server import Service
from spikeport.commands import board
from spikeport.commands.board import inspect, serve
from spikeport.commands.options_of_links import BoardService, Tls
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BoardLostError, MissingExtraError, UsageError
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train


def test_an_unknown_machine_is_refused() -> None:
    request = BoardService(listen="unix:x", machine="nativ", fault=[])
    with pytest.raises(UsageError, match="unknown machine 'nativ'"):
        serve(request, Tls())


@pytest.mark.parametrize("machine", ["snips", "native"])
def test_machine_and_rtl_together_are_refused(machine: str) -> None:
    request = BoardService(listen="unix:x", machine=machine, rtl=True, fault=[])
    with pytest.raises(UsageError, match="each choose what the board is; give one of them"):
        serve(request, Tls())


@pytest.mark.parametrize(
    ("machine", "reason"),
    [
        ("nxsdk", "no NxSDK is installed here"),
        ("snips", "no gcc is installed"),
        ("rtl", "no verilator is installed"),
    ],
)
def test_a_machine_that_lacks_a_program_is_refused_before_a_host_connects(
    machine: str, reason: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    request = BoardService(listen=f"unix:{tmp_path / 'socket'}", machine=machine, fault=[])
    with pytest.raises(MissingExtraError, match=reason):
        serve(request, Tls())
    assert list(tmp_path.iterdir()) == []


def test_the_option_rtl_chooses_the_machine_that_needs_verilator(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    request = BoardService(listen="unix:x", rtl=True, fault=[])
    with pytest.raises(MissingExtraError, match="no verilator is installed"):
        serve(request, Tls())


def test_a_rate_without_a_serial_line_is_refused() -> None:
    request = BoardService(listen="unix:x", baud=115_200, fault=[])
    with pytest.raises(UsageError, match="--baud: only a serial line has a rate; cure: --device"):
        serve(request, Tls())


def test_a_missing_device_is_refused_before_a_host_connects(tmp_path: Path) -> None:
    request = BoardService(listen=f"unix:{tmp_path / 's'}", device=tmp_path / "tty", fault=[])
    with pytest.raises(UsageError, match=r"device '.*tty' cannot be opened: No such file"):
        serve(request, Tls())
    assert list(tmp_path.iterdir()) == []


def test_the_image_that_a_host_sends_is_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    services: list[Service] = []
    monkeypatch.setattr(board, "serve_board", lambda service, _say: services.append(service))
    kept = tmp_path / "folder" / "image.npz"
    serve(BoardService(listen=f"unix:{tmp_path / 's'}", keep=kept, fault=[]), Tls())
    BoardChip(small_image(), 0, FakeLine(Board(services[0].machine), FakeClock(), ())).close()
    assert ChipImage.load(kept).digest == small_image().digest


def test_an_image_that_cannot_be_kept_is_refused_and_the_board_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    services: list[Service] = []
    monkeypatch.setattr(board, "serve_board", lambda service, _say: services.append(service))
    kept = tmp_path / "image.npz"
    serve(BoardService(listen=f"unix:{tmp_path / 's'}", keep=kept, fault=[]), Tls())
    served = Board(services[0].machine)
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(
            BoardLostError, match=r"--keep .*: cannot be written \(No space left on device\)"
        ):
            BoardChip(small_image(), 0, FakeLine(served, FakeClock()))
    assert not kept.exists()
    BoardChip(small_image(), 0, FakeLine(served, FakeClock())).close()
    assert kept.is_file()


@pytest.mark.parametrize("seconds", ["inf", "1e300"])
def test_an_idle_time_that_no_system_can_wait_is_refused(
    spikeport: Callable[..., Any], tmp_path: Path, seconds: str
) -> None:
    done = spikeport("board", "serve", "--listen", f"unix:{tmp_path / 's'}", "--idle", seconds)
    assert done.code == 2
    assert "Invalid value for '--idle'" in done.err


def test_an_image_is_not_kept_in_place_of_another_file(tmp_path: Path) -> None:
    model = tmp_path / "model.py"
    model.write_text("import nengo")
    with pytest.raises(UsageError, match="exists, and is not a chip image; choose another"):
        serve(BoardService(listen=f"unix:{tmp_path / 's'}", keep=model, fault=[]), Tls())
    assert model.read_text() == "import nengo"


def recorded(path: Path, faults: tuple[str, ...] = ()) -> None:
    clock = FakeClock()
    line = FakeLine(Board(MACHINE), clock, faults)
    chip = BoardChip(small_image(), 5, line, recorder=SessionRecorder(path), clock=clock)
    for spikes in spike_train(10):
        chip.step(spikes, {})
    chip.close()


def test_inspect_sums_up_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded(tmp_path / "record")
    assert inspect(tmp_path / "record") == 0
    assert capsys.readouterr().out.splitlines() == [
        f"image {small_image().digest[:12]}, seed 5, on native",
        "10 steps, of which 0 held; 1 bytes of spikes a step",
        "whole: the session ended as it should",
    ]


def test_inspect_does_not_count_learning_errors_as_spikes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorder = SessionRecorder(tmp_path / "record")
    recorder.begin(Hello("0" * 64, 5), Welcome("0" * 64, "native", 1000.0))
    body, flags = Codec(small_image()).pack_step(np.array([3]), {0: np.ones(7)})
    recorder.step(1, flags, body, b"")
    recorder.close()
    assert inspect(tmp_path / "record") == 0
    assert "1 step, of which 0 held; 1 bytes of spikes a step" in capsys.readouterr().out


def test_inspect_refuses_a_step_without_its_counts_and_prints_no_codes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "record"
    recorder = SessionRecorder(path)
    recorder.begin(Hello("0" * 64, 5), Welcome("0" * 64, "\x1b[31mred", 1000.0))
    recorder.close()
    inspect(path)
    assert "\x1b" not in capsys.readouterr().out
    path.unlink()
    recorder = SessionRecorder(path)
    recorder.begin(Hello("0" * 64, 5), Welcome("0" * 64, "native", 1000.0))
    recorder.step(1, 0, b"", b"")
    recorder.close()
    with pytest.raises(UsageError, match=r"record: step 1: the step's body is cut: 0 bytes"):
        inspect(path)


def test_inspect_names_the_step_at_which_a_record_is_cut(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "record"
    recorded(path)
    path.write_bytes(path.read_bytes()[:-150])
    assert inspect(path) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "cut or damaged after step 9"


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_server_that_is_ended_leaves_no_socket(number: signal.Signals, tmp_path: Path) -> None:
    path = tmp_path / "socket"
    command = [sys.executable, "-m", "spikeport", "board", "serve", "--listen", f"unix:{path}"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"board: native on unix:{path}\n"
        assert path.is_socket()
        process.send_signal(number)
        assert process.communicate(timeout=20) == ("", "")
        assert process.returncode == 0
    assert not path.exists()
