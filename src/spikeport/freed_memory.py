"""The memory of large arrays that were freed, kept for the next ones.

glibc gives an array of more than 128 KB (up to 32 MB, which it adjusts as it runs) back to the
system as soon as it is freed. The next one gets new pages, each of which is zeroed and mapped when
it is first touched: in a virtual machine that takes longer than many NumPy operations. A compile
makes and frees such arrays all the time.

Source: mallopt(3) of the Linux manual.
"""

import contextlib
import ctypes
from collections.abc import Iterator

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""glibc's M_TRIM_THRESHOLD, and M_MMAP_THRESHOLD."""
_MOST = 2**31 - 1
"""The largest value that mallopt takes: an int. Before glibc 2.35 it takes none above `_USUAL`."""
_USUAL = 2**25
"""The largest threshold that glibc adjusts itself to."""


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Keep memory that is freed meanwhile, and give it back to the system at the end.

    It applies to the whole process. Where the C library has no ``mallopt``, nothing changes.
    """
    libc = ctypes.CDLL(None)
    if not hasattr(libc, "mallopt"):
        yield
        return
    _set_thresholds(libc, _MOST, _MOST)
    try:
        yield
    finally:
        # The earlier thresholds cannot be read; glibc itself trims at twice the mmap threshold.
        _set_thresholds(libc, _USUAL, 2 * _USUAL)
        libc.malloc_trim(0)


def _set_thresholds(libc: ctypes.CDLL, mmap: int, trim: int) -> None:
    if not libc.mallopt(_MMAP_THRESHOLD, mmap):
        libc.mallopt(_MMAP_THRESHOLD, _USUAL)
    libc.mallopt(_TRIM_THRESHOLD, trim)
