"""Digests of the files that a run reads."""

import os
from pathlib import Path

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.digests import check_unchanged, digest, digests
from tests.helpers.sweeps import write_path


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return the working folder, which holds the file of a path."""
    monkeypatch.chdir(tmp_path)
    write_path(tmp_path / "path.csv", 0.3)
    return tmp_path


def test_a_digest_is_of_the_content(here):
    before = digest(Path("path.csv"))
    assert len(before) == 12
    Path("path.csv").touch()
    assert digest(Path("path.csv")) == before
    write_path(Path("path.csv"), 0.2)
    assert digest(Path("path.csv")) != before


def test_a_pipe_an_absent_file_and_a_folder_have_no_digest(here):
    os.mkfifo("pipe")
    cure = "; cure: name a file that you can read$"
    with pytest.raises(UsageError, match=f"pipe: expected a file, found a pipe or a device{cure}"):
        digest(Path("pipe"))
    with pytest.raises(UsageError, match=rf"none\.csv: no such file{cure}"):
        digest(Path("none.csv"))
    with pytest.raises(UsageError, match=f"cannot be read: Is a directory{cure}"):
        digest(here)


def test_a_file_on_a_disk_that_fails_has_no_digest():
    # A process may open its own memory, but nothing is mapped at the address 0.
    with pytest.raises(UsageError, match="mem: cannot be read: Input/output error; cure: name a"):
        digest(Path("/proc/self/mem"))


def test_digests_are_by_name_each_once(here):
    Path("a.npz").write_bytes(b"")
    found = digests([Path("path.csv"), Path("a.npz"), Path("path.csv")])
    assert list(found.items()) == [(name, digest(Path(name))) for name in ("a.npz", "path.csv")]


def test_a_file_that_changed_is_refused(here):
    before = digests([Path("path.csv")])
    check_unchanged(before)
    write_path(Path("path.csv"), 0.2)
    with pytest.raises(UsageError) as caught:
        check_unchanged(before)
    assert str(caught.value) == (
        f"path.csv: changed while the network was made (digest {before['path.csv']} then, "
        f"{digest(Path('path.csv'))} now); cure: give the same command again"
    )
