"""Compiled kernels, also if their cache on disk cannot be written or is garbage."""

import errno
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import caching

from spikeport import compiled as compiling
from spikeport.compiled import compiled, make_ready

CURE = (
    "; each process compiles them anew, which takes about 10 s; "
    "set NUMBA_CACHE_DIR to a folder that can be written"
)


@pytest.fixture(autouse=True)
def nothing_warned_of(monkeypatch):
    monkeypatch.setattr(compiling, "WARNED", set())


def half_of() -> object:
    @compiled
    def half(values: np.ndarray) -> float:
        return values.sum() / 2

    return half


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """Return an empty folder for the cache of this process."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def run(function: object) -> None:
    make_ready(function, np.zeros(0))
    assert function(np.array([1.0, 2.0])) == 1.5


def test_a_function_made_ready_is_not_compiled_again_when_it_is_called():
    called = []

    @numba.njit
    def half(values):
        with numba.objmode():
            called.append(len(values))
        return values.sum() / 2

    make_ready(half, np.zeros(0))
    ready = list(half.signatures)
    assert (len(ready), called) == (1, [])
    assert half(np.array([1.0, 2.0])) == 1.5
    assert half.signatures == ready


@pytest.mark.filterwarnings("error")
def test_a_function_compiled_before_is_loaded_from_the_cache(cache):
    run(half_of())
    again = half_of()
    run(again)
    assert sum(again.stats.cache_hits.values()) == 1


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_garbage_in_the_cache_is_replaced_by_newly_compiled_code(cache, suffix):
    run(half_of())
    (garbage,) = cache.rglob(f"*.{suffix}")
    garbage.write_bytes(b"garbage")
    with pytest.warns(UserWarning, match="compiled kernels") as caught:
        run(half_of())
    (warning,) = caught
    assert str(warning.message) == (
        f"compiled kernels in {garbage.parent} are damaged; they are made anew"
    )
    healed = half_of()
    run(healed)
    assert sum(healed.stats.cache_hits.values()) == 1


def test_on_a_full_disk_kernels_are_compiled_and_a_warning_names_the_folder(cache, monkeypatch):
    def full(self, name, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(caching.IndexDataCacheFile, "_save_data", full)
    first, second = half_of(), half_of()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run(first)
        run(second)
    (warning,) = caught
    text = str(warning.message)
    assert text.startswith(f"compiled kernels cannot be kept in {cache}")
    assert text.endswith(f"([Errno 28] No space left on device){CURE}")


def test_without_any_folder_kernels_are_compiled_and_a_warning_names_the_setting(monkeypatch):
    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])
    monkeypatch.setattr(compiling, "NOWHERE", set())
    with pytest.warns(UserWarning, match="compiled kernels") as caught:
        run(half_of())
    (warning,) = caught
    assert str(warning.message) == (
        f"compiled kernels cannot be kept: no folder for them can be written{CURE}"
    )


RUN = """
import nengo, spikeport
with nengo.Network(seed=0) as network:
    nengo.Connection(nengo.Node([1]), nengo.Ensemble(10, 1))
spikeport.Simulator(network)
"""


@pytest.mark.slow
def test_a_simulator_is_refused_if_numba_disable_jit_is_set():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-W", "ignore", "-c", RUN]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stderr.splitlines()[-1] == (
        "spikeport.errors.BackendError: NUMBA_DISABLE_JIT is set, and spikeport runs on compiled "
        "kernels alone; unset it"
    )
