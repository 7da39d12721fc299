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
    """Give memory that other tests freed back to the system; return the bytes in memory."""
    ctypes.CDLL(None).malloc_trim(0)
    return resident()


def use(size: int) -> None:
    """Make an array of some bytes, and free it."""
    np.ones(size, dtype=np.uint8)


def fail() -> None:
    use(64 * MB)
    raise ZeroDivisionError


def test_freed_memory_is_kept_until_the_block_ends() -> None:
    before = trimmed()
    with freed_memory.kept():
        use(64 * MB)
        assert resident() > before + 48 * MB
    assert resident() < before + 16 * MB


def test_an_error_in_the_block_gives_freed_memory_back() -> None:
    before = trimmed()
    with pytest.raises(ZeroDivisionError), freed_memory.kept():
        fail()
    assert resident() < before + 16 * MB


def test_kept_does_nothing_if_the_c_library_has_no_mallopt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _name: object())
    entered = []
    with freed_memory.kept():
        entered.append(True)
    assert entered
