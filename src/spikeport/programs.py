"""Programs of the system that are run to their end, with all processes that they start."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

from spikeport.errors import BackendError, reason_of


def output_of(
    command: Sequence[str], failure: str, limit_s: float, folder: str | Path | None = None
) -> str:
    """Run a program to its end, and return its output.

    An interrupt ends the processes that it started, too: a compiler's driver starts many.

    Parameters
    ----------
    command : sequence of str
        The program and its arguments.
    failure : str
        The beginning of the message if it fails, e.g. ``"the soft core is not built"``.
    limit_s : float
        The time after which it is given up, in seconds.
    folder : path, optional
        The folder to run it in; by default the current one.

    Raises
    ------
    BackendError
        If it does not start, fails, with the first line of its errors, or takes longer.
    """
    try:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise BackendError(f"{failure}: {command[0]}: {reason_of(error)}") from None
    with process:
        try:
            output, errors = process.communicate(timeout=limit_s)
        except BaseException as error:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            if isinstance(error, subprocess.TimeoutExpired):
                raise BackendError(f"{failure} within {limit_s:,.0f} s") from None
            raise
    if process.returncode:
        first = next(iter(errors.splitlines()), f"exit code {process.returncode}")
        raise BackendError(f"{failure}: {first}")
    return output
