"""A child of our own command line: its first line is waited for, its last words are kept."""

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from spikeport.child import Child
from spikeport.errors import BackendError
from spikeport.pacing import later


def test_a_child_that_cannot_start_says_why() -> None:
    with pytest.raises(BackendError, match=r"the chip's server did not start: error: .*nonsense"):
        Child("chip", ["show", "nonsense"])


def test_files_of_the_current_folder_are_no_modules_of_a_child(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "platform.py").write_text("raise SystemExit('not this one')")
    with pytest.raises(BackendError, match="did not start: error: nonsense: no such file"):
        Child("chip", ["show", "nonsense"])


def served_by(script: str, monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[str]]:
    """Let servers be a script of Python, whatever their arguments; return their processes."""
    made: list[subprocess.Popen[str]] = []
    started = subprocess.Popen

    def start(_: object, **asked: object) -> subprocess.Popen[str]:
        made.append(started([sys.executable, "-c", script], **asked))
        return made[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    return made


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_a_child_starts_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process does not wait for timers that it leaves, and leaves no child."""
    processes = served_by("import time; time.sleep(100)", monkeypatch)
    main = threading.get_ident()
    with (
        pytest.raises(KeyboardInterrupt),
        later(0.3, lambda: signal.pthread_kill(main, signal.SIGINT)),
    ):
        Child("chip", [])
    assert processes[0].poll() == -signal.SIGKILL
    left = [one for one in threading.enumerate() if isinstance(one, threading.Timer)]
    assert all(one.daemon for one in left)


@pytest.mark.parametrize(("code", "words"), [(0, "exit code 0"), (-9, "killed by SIGKILL")])
def test_a_child_without_words_says_how_it_ended(
    code: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = "import os; os.kill(os.getpid(), 9)" if code else ""
    served_by(f"print('chip: serves', flush=True); {end}", monkeypatch)
    assert Child("chip", []).close() == words
