"""Results that workers share."""

import fcntl
import multiprocessing
import os
import threading
import time

import numpy as np
import pytest

from spikeport.experiments.sweep.store import Store


def made(folder, marks):
    """Return a result from a store, and leave a mark if this call had to make it."""

    def make():
        time.sleep(0.3)
        (marks / f"{threading.get_ident()}-{time.monotonic_ns()}").touch()
        return {"found": np.arange(3)}

    return Store(folder).kept("gait", "inputs", make)["found"].tolist()


def folders(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    return tmp_path / "store", marks


@pytest.mark.slow
def test_a_result_that_processes_need_at_the_same_time_is_made_once(tmp_path):
    store, marks = folders(tmp_path)
    with multiprocessing.get_context("fork").Pool(3) as pool:
        found = pool.starmap(made, [(store, marks)] * 3, chunksize=1)
    assert found == [[0, 1, 2]] * 3
    assert len(list(marks.iterdir())) == 1
    assert [path.suffix for path in store.iterdir()] == [".npz"]


def test_a_result_that_fails_leaves_no_lock(tmp_path):
    store, marks = folders(tmp_path)

    def fails():
        raise ValueError("no gait")

    with pytest.raises(ValueError, match="no gait"):
        Store(store).kept("gait", "inputs", fails)
    assert made(store, marks) == [0, 1, 2]


def test_a_result_is_made_even_if_nothing_can_be_locked(tmp_path, recwarn):
    store, marks = folders(tmp_path)
    store.touch()
    assert made(store, marks) == [0, 1, 2]
    assert "is made anew" in str(recwarn.pop().message)


@pytest.mark.parametrize("broken", ["flock", "unlink"])
def test_a_lock_that_fails_keeps_no_file_open(tmp_path, monkeypatch, broken):
    def fails(*_args, **_kwargs):
        raise OSError("no locks here")

    store, marks = folders(tmp_path)
    monkeypatch.setattr(fcntl if broken == "flock" else type(tmp_path), broken, fails)
    before = len(os.listdir("/proc/self/fd"))
    assert made(store, marks) == [0, 1, 2]
    assert len(os.listdir("/proc/self/fd")) == before
