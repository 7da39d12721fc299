"""The time series of a run under way, on request of viewers in other processes.

A viewer leaves an empty file in the run's folder, as a request. The run looks for it between its
steps, writes its time series so far beside it, and then removes the request. A run that nobody
watches writes nothing.
"""

import contextlib
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.atomic import locked
from spikeport.errors import UsageError
from spikeport.experiments.run_folder import REQUEST, SO_FAR, write_dataset

if TYPE_CHECKING:
    import xarray as xr

POLL_S = 0.05
"""Time between two looks for an answer."""


def answer(folder: Path, series: Callable[[], "xr.Dataset"]) -> None:
    """Write a run's time series so far, if a viewer has asked for them."""
    request = folder / REQUEST
    if not request.exists():
        return
    try:
        write_dataset(folder / SO_FAR, series())
    except (OSError, UsageError) as error:  # such as a full disk, which must not end the run
        warnings.warn(f"the run goes on, but a viewer gets nothing new: {error}", stacklevel=1)
    # Last: a viewer reads the series once its request is gone.
    with contextlib.suppress(OSError):
        request.unlink()


def ask(folder: Path, wait_s: float) -> bool:
    """Ask a run for its time series so far, and return whether it has answered."""
    request = folder / REQUEST
    try:
        request.touch()
    except FileNotFoundError:  # the run was interrupted, and removed its folder
        return False
    deadline = time.monotonic() + wait_s
    while request.exists():
        if time.monotonic() > deadline:
            return False
        time.sleep(POLL_S)
    return True


def is_running(folder: Path) -> bool:
    """Return whether a run is still writing into a folder."""
    try:
        with locked(folder):
            return False
    except UsageError:
        return True
    except FileNotFoundError:  # the run was interrupted, and removed its folder
        return False
