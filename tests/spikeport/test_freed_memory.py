import ctypes
import os
from pathlib import Path

import numpy as np
import pytest

from spikeport import freed_memory

pytestmark = pytest.mark.skipif(
    not hasattr(ctypes.CDLL(None), "mallopt"), reason="the C library has no mallopt"
)
MB = 2**20


def resident() -> int:
    """Return the bytes of this process that are in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def trimmed() -> int:
    """Return the bytes in memory once what other tests freed went back to the system."""
    ctypes.CDLL(None).malloc_trim(0)
    return resident()


def use(size: int) -> None:
    """Make an array of some bytes, and free it."""
    np.ones(size, dtype=np.uint8)


def fail() -> None:
    use(64 * MB)
    raise ZeroDivisionError


def test_what_is_freed_is_kept_until_the_end() -> None:
    before = trimmed()
    with freed_memory.kept():
        use(64 * MB)
        assert resident() > before + 48 * MB
    assert resident() < before + 16 * MB


def test_an_error_gives_it_back_too() -> None:
    before = trimmed()
    with pytest.raises(ZeroDivisionError), freed_memory.kept():
        fail()
    assert resident() < before + 16 * MB


def test_it_does_nothing_where_the_c_library_has_no_such_function(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _name: object())
    entered = []
    with freed_memory.kept():
        entered.append(True)
    assert entered
