"""Temporary folders: leftovers of killed sweeps are removed, and other folders stay."""

import fcntl
import os

import pytest

from spikeport.experiments.sweep.scratch import remove_leftovers, scratch_folder


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_a_folder_exists_for_the_block_and_only_its_user_may_read_it(temporary):
    with scratch_folder() as path:
        assert os.stat(path).st_mode & 0o777 == 0o700
        (temporary / path / "file").touch()
        remove_leftovers()
        assert os.listdir(path) == ["file"]
    assert os.listdir(temporary) == []


def test_the_folder_of_a_killed_sweep_is_removed(temporary):
    left, other = temporary / "spikeport-sweep-left", temporary / "other"
    for folder in (left, other):
        (folder / "sub").mkdir(parents=True)
        (folder / "sub" / "file").touch()
    with scratch_folder():
        assert not left.exists()
    assert other.exists()


def test_a_folder_that_another_sweep_has_locked_stays(temporary):
    used = temporary / "spikeport-sweep-used"
    used.mkdir()
    lock = os.open(used, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    remove_leftovers()
    assert used.exists()
    os.close(lock)
    remove_leftovers()
    assert not used.exists()


def test_links_and_files_named_like_a_sweeps_folder_stay(temporary):
    target = temporary / "target"
    target.mkdir()
    (temporary / "spikeport-sweep-link").symlink_to(target)
    (temporary / "spikeport-sweep-file").touch()
    remove_leftovers()
    assert {path.name for path in temporary.iterdir()} == {
        "target",
        "spikeport-sweep-link",
        "spikeport-sweep-file",
    }
