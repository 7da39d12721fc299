"""Child processes of spikeport's own command line: how they start, and how they end."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from spikeport.child import LINES_KEPT, Child
from spikeport.errors import BackendError
from spikeport.pacing import later


def test_a_child_that_cannot_start_says_why() -> None:
    with pytest.raises(BackendError, match=r"the chip's server did not start: error: .*nonsense"):
        Child("chip", ["show", "nonsense"])


def test_a_child_does_not_import_files_of_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "platform.py").write_text("raise SystemExit('not this one')")
    with pytest.raises(BackendError, match="did not start: error: nonsense: no such file"):
        Child("chip", ["show", "nonsense"])


def served_by(script: str, monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[str]]:
    """Start a Python script in place of every process; return the started processes."""
    made: list[subprocess.Popen[str]] = []
    started = subprocess.Popen

    def start(_: object, **asked: object) -> subprocess.Popen[str]:
        made.append(started([sys.executable, "-c", script], **asked))
        return made[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    return made


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_kills_a_child_that_is_starting(monkeypatch: pytest.MonkeyPatch) -> None:
    processes = served_by("import time; time.sleep(100)", monkeypatch)
    main = threading.get_ident()
    with (
        pytest.raises(KeyboardInterrupt),
        later(0.3, lambda: signal.pthread_kill(main, signal.SIGINT)),
    ):
        Child("chip", [])
    assert processes[0].poll() == -signal.SIGKILL


def test_timers_are_daemons_which_the_end_of_the_process_does_not_wait_for() -> None:
    with later(60, lambda: None):
        timers = [one for one in threading.enumerate() if isinstance(one, threading.Timer)]
        assert [one.daemon for one in timers] == [True]


@pytest.mark.parametrize(("code", "words"), [(0, "exit code 0"), (-9, "killed by SIGKILL")])
def test_closing_a_child_without_further_output_returns_how_it_ended(
    code: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = "import os; os.kill(os.getpid(), 9)" if code else ""
    served_by(f"print('chip: serves', flush=True); {end}", monkeypatch)
    assert Child("chip", []).close() == words


def test_a_child_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spikeport.child.STOP_S", 0.1)
    served_by("import time; print('chip: serves', flush=True); time.sleep(100)", monkeypatch)
    assert Child("chip", []).close() == "killed by SIGKILL"


def test_a_child_that_prints_more_than_a_pipe_holds_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    served_by("print('chip: serves'); [print(f'line {i:06}') for i in range(10**5)]", monkeypatch)
    child, until = Child("chip", []), time.monotonic() + 30
    while child.runs and time.monotonic() < until:
        time.sleep(0.01)
    assert not child.runs  # before anybody closes it
    lines = child.close().splitlines()
    assert lines == [f"line {i:06}" for i in range(10**5 - LINES_KEPT, 10**5)]


def test_odd_bytes_of_a_child_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    served_by(
        "import sys; print('chip: serves', flush=True); sys.stdout.buffer.write(b'\\xff one\\n')",
        monkeypatch,
    )
    assert Child("chip", []).close() == "\N{REPLACEMENT CHARACTER} one"


def test_lines_before_that_of_the_server_are_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    served_by("print('OpenBLAS WARNING'); print('chip: serves'); print('done')", monkeypatch)
    assert Child("chip", []).close() == "done"


def test_a_child_that_ends_before_it_serves_is_quoted_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    served_by("print('a warning'); print('error: no such board')", monkeypatch)
    with pytest.raises(BackendError, match=r"did not start: a warning\nerror: no such board$"):
        Child("chip", [])


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_kills_a_child_that_is_being_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    script = "import time; print('chip: serves', flush=True); time.sleep(100)"
    processes = served_by(script, monkeypatch)
    child, main = Child("chip", []), threading.get_ident()
    with (
        pytest.raises(KeyboardInterrupt),
        later(0.3, lambda: signal.pthread_kill(main, signal.SIGINT)),
    ):
        child.close()
    assert processes[0].wait(10) == -signal.SIGKILL
