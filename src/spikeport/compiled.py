"""Compiled functions: cached on disk if possible, and compiled before they are called."""

import contextlib
import warnings
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from numba import config, njit, typeof
from numba.core.caching import FunctionCache

from spikeport.errors import BackendError

F = TypeVar("F", bound=Callable[..., object])
DISABLE_JIT = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]
NOWHERE: set[object] = set()
"""Compiled functions for which numba found no folder that it can write."""
WARNED: set[str] = set()
SLOW = (
    "; each process compiles them anew, which takes about 10 s; set NUMBA_CACHE_DIR to a folder "
    "that can be written"
)


class KernelCache(FunctionCache):
    """numba's cache on disk, whose files may be unreadable, garbage, or on a full disk.

    Code that cannot be loaded is compiled again and replaced, and code that cannot be kept is
    compiled in each process. Neither stops a run; a warning names the folder.
    """

    @contextlib.contextmanager
    def _guard_against_spurious_io_errors(self) -> Iterator[None]:
        """Replace numba's guard, which wraps all reading and writing of cache files."""
        try:
            yield
        except OSError as error:
            _warn_once(f"compiled kernels cannot be kept in {self.cache_path} ({error}){SLOW}")
        except Exception:  # garbage raises anything when it is unpickled
            _warn_once(f"compiled kernels in {self.cache_path} are damaged; they are made anew")
            with contextlib.suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]


def _warn_once(text: str) -> None:
    """Warn of the cache once in a process: every kernel has the same problem."""
    if text not in WARNED:
        WARNED.add(text)
        warnings.warn(text, stacklevel=2)


def compiled(function: F) -> F:
    """Compile a function when it is first called, or load it from the cache on disk."""
    return _cached(njit(function), function)


def without_gil(function: F) -> F:
    """Compile a function that releases Python's GIL; see `compiled`."""
    return _cached(njit(nogil=True)(function), function)


def inlined(function: F) -> F:
    """Compile a function into its callers."""
    return _cached(njit(inline="always")(function), function)


def _cached(dispatcher: Any, function: F) -> F:
    if not DISABLE_JIT:
        try:
            # As `njit(cache=True)` does, with our own class.
            dispatcher._cache = KernelCache(function)  # type: ignore[no-untyped-call]
        except RuntimeError:
            NOWHERE.add(dispatcher)
    result: F = dispatcher
    return result


def make_ready(function: Any, *arguments: object) -> Callable[..., Any]:
    """Compile a function for arguments of these types, or load it from the cache on disk.

    Compiling takes seconds, and a call takes microseconds: a measurement of steps should not time
    both.

    Returns
    -------
    callable
        The compiled code for these types. Calling it saves the microsecond in which numba looks it
        up; it takes no arguments of other types.

    Raises
    ------
    BackendError
        If numba is set to compile nothing.
    """
    if DISABLE_JIT:
        raise BackendError(
            "NUMBA_DISABLE_JIT is set, and spikeport runs on compiled kernels alone; unset it"
        )
    if function in NOWHERE:
        _warn_once(f"compiled kernels cannot be kept: no folder for them can be written{SLOW}")
    code: Callable[..., Any] = function.compile(tuple(typeof(one) for one in arguments))
    return code
