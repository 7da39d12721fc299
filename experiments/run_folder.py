"""A run's folder: result, time series, figure, report of the compile and, on request, a video.

Every file is written whole or not at all, and ``result.json`` is written last: a folder without it
is a run that did not finish.
"""

import contextlib
import os
import platform
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spikeport.atomic import PART, atomic_path, is_leftover, locked
from spikeport.compile.report.page import write_page
from spikeport.compile.report.report import Json
from spikeport.errors import UsageError
from spikeport.extras import version_of
from spikeport.files import write_arrays, write_json

if TYPE_CHECKING:
    import xarray as xr

Result = dict[str, Any]
"""The content of ``result.json``, or of an object in it."""
RESULT_SCHEMA = 1
REQUEST, SO_FAR = "live.request", "live.nc"
"""A viewer's request and the run's answer, see `spikeport.experiments.watching`."""
LAST_STATES = "last_states.npz"
FILES = (
    *("result.json", "probes.nc", "figure.png", "report.json", "report.html"),
    *("video.mp4", LAST_STATES, "view.html", REQUEST, SO_FAR),
)
COUNTS = "counts"
"""The subfolder for the counts of every step, see `spikeport.backends.step_log.StepLog`."""
NEW = ".run"
"""The beginning of the name of a folder in which a run is written."""
PACKAGES = ("spikeport", "numpy", "scipy", "nengo", "nengo-loihi", "mujoco")


@contextlib.contextmanager
def opened(out: Path | None, experiment: str, overwrite: bool = False) -> Iterator[Path]:
    """Make a folder for a run; by default ``runs/<experiment>-<date>-<time>``.

    An earlier run in the folder is kept until the new one is written (`renewed`). No other process
    writes into the folder meanwhile. A folder that was made here and is still empty is removed.

    Raises
    ------
    UsageError
        If the folder cannot be made, is in use, or holds anything but an earlier run that may be
        overwritten.
    """
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = out or Path("runs") / f"{experiment}-{stamp}"
    is_ours = not os.path.exists(folder)
    try:
        # Two runs that start in the same second must not share a default folder.
        folder.mkdir(parents=True, exist_ok=out is not None)
    except OSError as error:
        raise UsageError(
            f"{folder}: cannot be made ({error.strerror}); choose another --out"
        ) from None
    with locked(folder):
        # Before the try block, whose end removes files: in a read-only folder this would fail, too.
        _check_free(folder, overwrite)
        try:
            yield folder
        finally:
            _tidy(folder, is_ours)


def _check_free(folder: Path, overwrite: bool) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"{folder}: cannot be written to; choose another --out")
    # Half-written files of a run that was killed do not count.
    held = {path.name for path in folder.iterdir() if not is_leftover(path)}
    if held - {*FILES, COUNTS}:
        raise UsageError(f"{folder}: holds more than a run; choose another --out")
    # Last states alone are left by a run that did not finish.
    if held - {LAST_STATES} and not overwrite:
        raise UsageError(f"{folder}: holds a run; choose another --out, or give --overwrite")


def check_outside(folder: Path, option: str, path: Path | None) -> None:
    """Refuse a file in the folder of a run, where one would replace the other.

    Raises
    ------
    UsageError
        If the file lies in the folder; the error names the option that asks for it.
    """
    if path is not None and folder.resolve() in path.resolve().parents:
        raise UsageError(
            f"{option} {path}: lies in {folder}, the folder of the run, which holds nothing else; "
            "choose another place"
        )


@contextlib.contextmanager
def renewed(folder: Path) -> Iterator[Path]:
    """Make a folder for the files of a run, which then replace those of an earlier run.

    If one of them cannot be written, as on a full disk, the earlier run stays as it was. The run's
    folder is made if there is none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob(f"{NEW}*{PART}"):  # of a run that was killed
        shutil.rmtree(stale, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=NEW, suffix=PART, dir=folder) as name:
        new = Path(name)
        try:
            yield new
        except OSError as error:
            # Users know the folder of the run alone.
            if str(error.filename).startswith(name):
                error.filename = str(folder) + str(error.filename)[len(name) :]
            raise
        clear(folder)
        # The result comes last: a folder without one is a run that did not finish.
        for path in sorted(new.iterdir(), key=lambda path: path.name == "result.json"):
            path.replace(folder / path.name)


def clear(folder: Path) -> None:
    """Remove an earlier run, its result first, so that half a run does not look finished."""
    leftovers = (path for path in folder.glob("*") if is_leftover(path) and path.is_file())
    for path in [*(folder / name for name in FILES), *leftovers]:
        path.unlink(missing_ok=True)
    shutil.rmtree(folder / COUNTS, ignore_errors=True)


@contextlib.contextmanager
def counting(asked: bool) -> Iterator[Path | None]:
    """Make a folder for the counts of a run under way, if they are asked for."""
    if not asked:
        yield None
        return
    with tempfile.TemporaryDirectory(prefix="spikeport-counts-") as folder:
        yield Path(folder)


def add_counts(folder: Path, counted: Path | None) -> None:
    """Copy the counts of a run into its folder, if there are any."""
    for file in [] if counted is None else counted.iterdir():
        with atomic_path(folder / COUNTS / file.name) as temporary:
            temporary.write_bytes(file.read_bytes())


def _tidy(folder: Path, is_ours: bool) -> None:
    """Remove the files of viewers, and the folder if this run made it and it is empty."""
    # A file that cannot be removed must not hide the error or interrupt that ended the run.
    for name in (REQUEST, SO_FAR):
        with contextlib.suppress(OSError):
            (folder / name).unlink()
    if is_ours:
        with contextlib.suppress(OSError):  # it holds a run
            folder.rmdir()


def write_result(folder: Path, result: Mapping[str, object]) -> None:
    """Write ``result.json``, with schema and versions added."""
    versions = {name: version_of(name) for name in PACKAGES}
    whole = {
        "schema": RESULT_SCHEMA,
        **result,
        "versions": {"python": platform.python_version(), **versions},
    }
    write_json(folder / "result.json", whole)


def write_report(folder: Path, report: Json, title: str) -> None:
    """Write ``report.json`` and ``report.html``."""
    write_json(folder / "report.json", report)
    write_page(folder / "report.html", report, title)


def write_probes(folder: Path, dataset: "xr.Dataset") -> None:
    """Write ``probes.nc``."""
    write_dataset(folder / "probes.nc", dataset)


def write_dataset(path: Path, dataset: "xr.Dataset") -> None:
    """Write time series as netCDF, whole or not at all."""
    # In memory first: on a full disk HDF5's library ends the process instead of raising an error.
    with dataset.to_netcdf(engine="h5netcdf") as content, atomic_path(path) as temporary:
        temporary.write_bytes(content)


def write_figure(folder: Path, picture: bytes) -> None:
    """Write ``figure.png``; its content is made by `spikeport.plots.rendered`."""
    with atomic_path(folder / "figure.png") as temporary:
        temporary.write_bytes(picture)


def write_last_states(folder: Path, history: Mapping[str, np.ndarray]) -> Path:
    """Save the last states of a run that failed, in place of any earlier run."""
    clear(folder)
    return add_last_states(folder, history)


def add_last_states(folder: Path, history: Mapping[str, np.ndarray]) -> Path:
    """Save the last states beside a run's other files."""
    path = folder / LAST_STATES
    write_arrays(path, history)
    return path
