"""The process of a command: standard streams, folders, environment, the width of its texts."""

import contextlib
import io
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.errors import UsageError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

ERRORS = "backslashreplace"
"""The treatment of letters that a stream cannot encode: labels and names of files may hold any."""


class _Unfailing(io.FileIO):
    """Standard error, which drops a text that cannot be written."""

    def write(self, data: "ReadableBuffer") -> int:
        """Write bytes, and return how many were written or dropped."""
        with contextlib.suppress(OSError):
            return super().write(data)
        return memoryview(data).nbytes


def prepare() -> None:
    """Make ready the standard streams, the width that texts are broken at, and matplotlib.

    Progress and warnings must not end the work that they are about: on a full disk, on a terminal
    that is closed or in a pipe that nobody reads, they are lost.
    """
    _open_closed()
    # An embedding program's or a test's stream stays: only those of Python itself are replaced.
    if sys.stderr is sys.__stderr__:
        encoding = None if sys.stderr is None else sys.stderr.encoding
        raw = io.BufferedWriter(_Unfailing(2, "w", closefd=False))
        sys.stderr = io.TextIOWrapper(raw, encoding, ERRORS, line_buffering=True)
    if sys.stdout is None:
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors=ERRORS)
    # A terminal without a size has 0 columns, in which rich would print nothing.
    if os.environ.get("COLUMNS") == "0":
        del os.environ["COLUMNS"]
    # A notebook's shell names a backend of matplotlib that may be absent here; ours writes files.
    if os.environ.get("MPLBACKEND", "").startswith("module://"):
        os.environ["MPLBACKEND"] = "agg"


def _open_closed() -> None:
    """Open standard streams that a shell has closed, as ``>&-`` does, on the null device.

    Otherwise the next files that are opened would take their numbers, and libraries and other
    processes would write into them.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The system takes the lowest number that is free: this one.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def say(line: str) -> None:
    """Print a line of a server's at once: the process that started it may wait for the first.

    A log that cannot be written, on a full disk or in a pipe that nobody reads, ends no session.
    """
    with contextlib.suppress(OSError):
        print(line, flush=True)


def check_environment() -> None:
    """Raise UsageError for an environment in which a package cannot be imported."""
    _check_folders()
    _check_variables()


def _check_folders() -> None:
    """Refuse a process without a current folder or a home, which Nengo needs."""
    try:
        os.getcwd()
    except FileNotFoundError:
        raise UsageError(
            "the current folder has been removed; cure: cd into one that exists"
        ) from None
    try:
        Path.home()
    except RuntimeError:
        raise UsageError(
            f"user {os.getuid()} has no home folder; cure: set HOME to a folder, as HOME=/tmp"
        ) from None


def _check_variables() -> None:
    """Refuse settings with which numba or matplotlib cannot be imported."""
    threads, n_threads = os.environ.get("NUMBA_NUM_THREADS", ""), 1
    with contextlib.suppress(ValueError):  # numba, too, takes no notice of what is no number
        n_threads = int(threads)
    if n_threads < 1:
        raise UsageError(
            f"NUMBA_NUM_THREADS is {threads}, and numba needs one thread at least; "
            "cure: unset NUMBA_NUM_THREADS"
        )
    backend = os.environ.get("MPLBACKEND")
    if backend not in (None, "", "agg"):  # to import matplotlib takes longer than most commands
        try:
            with contextlib.suppress(ImportError):
                import matplotlib  # noqa: F401
        except ValueError:
            raise UsageError(
                f"MPLBACKEND is {backend}, which matplotlib does not know; cure: unset MPLBACKEND"
            ) from None
