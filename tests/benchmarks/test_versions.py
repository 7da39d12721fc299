"""Versions that run in turn."""

import tempfile

import compile_versions
import pytest
import versions


class Ends:
    """A process whose run has ended."""

    def __init__(self, command, **_options):
        self.command, self.stdin, self.stdout = command, self, self
        self.killed = False

    def write(self, _text):
        raise BrokenPipeError

    def readline(self):
        return ""

    def kill(self):
        self.killed = True

    def wait(self):
        return 0


def test_a_run_that_ended_leaves_no_folder_and_no_process(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(
        versions.subprocess, "Popen", lambda *args, **_: made.append(Ends(*args)) or made[-1]
    )
    with pytest.raises(SystemExit, match="its run has ended"):
        versions.compare("reach", "/old", 1)
    assert [process.killed for process in made] == [True, True]
    assert all(str(tmp_path) in process.command[-1] for process in made)
    assert list(tmp_path.iterdir()) == []


def test_the_first_round_of_compiles_does_not_count(monkeypatch):
    found = iter([99.0, 98.0, 4.0, 2.0, 6.0, 3.0])
    monkeypatch.setattr(
        compile_versions, "_in_process", lambda *_: {"cpu_s": next(found), "mb": 0.0}
    )
    row = compile_versions.compare("arm", "/old", 2)
    assert row[:4] == ("arm", "5.0", "2.5", "2.0")
