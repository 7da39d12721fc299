"""A child of our own command line: its first line is waited for, its last words are kept."""

import subprocess
import sys

import pytest

from spikeport.child import Child
from spikeport.errors import BackendError


def test_a_child_that_cannot_start_says_why() -> None:
    with pytest.raises(BackendError, match=r"the chip's server did not start: error: .*nonsense"):
        Child("chip", ["show", "nonsense"])


@pytest.mark.parametrize(("code", "words"), [(0, "exit code 0"), (-9, "killed by SIGKILL")])
def test_a_child_without_words_says_how_it_ended(
    code: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = "import os; os.kill(os.getpid(), 9)" if code else ""
    script = f"print('chip: serves', flush=True); {end}"
    # The server of these tests is a line of Python, whatever its arguments.
    started = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda _, **asked: started([sys.executable, "-c", script], **asked)
    )
    assert Child("chip", []).close() == words
