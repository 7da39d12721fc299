"""``spikeport view RUN``: a page that plays a run in a browser, also while the run goes on."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spikeport.atomic import check_apart, check_output
from spikeport.errors import UsageError
from spikeport.experiments import run_folder, watching
from spikeport.experiments.registry import imported
from spikeport.files import read_json
from spikeport.reading.hdf5 import read_dataset
from spikeport.reading.mismatch import MismatchError, shown

PAGE = "view.html"
MALFORMED = (AttributeError, ValueError, TypeError, LookupError)
"""Errors of drawing time series that do not come from a run."""


def run(folder: Path, out: Path | None, live: bool = False) -> None:
    """Write the page of a run; if ``live``, serve it first until the run ends.

    Raises
    ------
    UsageError
        If the path is not a folder, if it holds no finished run or, with ``live``, no run that goes
        on, or if its time series cannot be read.
    MissingExtraError
        If xarray or MuJoCo is absent.
    """
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise UsageError(f"{folder}: is a file; name the folder of a run")
    page = out or folder / PAGE
    check_output("--out", page, suffix=".html")
    files = [("the run", folder / name) for name in run_folder.FILES if name != PAGE]
    check_apart([*files, ("--out", page)])
    if live:
        _watch(folder)
    path = folder / "result.json"
    result = read_json(path) if path.is_file() else None
    if not isinstance(result, dict) or not (folder / "probes.nc").is_file():
        states = folder / run_folder.LAST_STATES
        left = f"; the last states of one that did not end are in {states}"
        raise UsageError(
            f"{folder}: no finished run{left if states.is_file() else ''}; cure: name a folder "
            "that `run` or `simulate` has written"
        )
    # A run of `simulate` has a model in place of an experiment.
    what = result.get("experiment") or result.get("model", "run")
    write(folder / "probes.nc", page, f"{what}: {folder}")
    print(f"written: {page} ({page.stat().st_size / 1e6:.1f} MB); open it in a browser")


def _watch(folder: Path) -> None:
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder")
    others = {"sweep.json": "a sweep or an evaluation", "checkpoints": "a training"}
    for name, what in others.items():
        if (folder / name).exists():
            raise UsageError(f"{folder}: holds {what}, which has no live view; name a run's folder")
    if not watching.is_running(folder):
        raise UsageError(f"{folder}: no run goes on in it; cure: leave out --live")
    live = imported("view", "spikeport.experiments.viewer.live", "runs")
    with _readable(folder):
        is_whole = live.watch(folder, f"live: {folder}", _announce)
    if not is_whole and (folder / "result.json").is_file():
        raise UsageError(
            f"{folder}: the run ended without a result, and an earlier run's is left; cure: leave "
            "out --live to see that one"
        )


def _announce(url: str) -> None:
    print(f"open {url} in a browser; it follows the run to its end", flush=True)


def write(probes: Path, path: Path, title: str) -> None:
    """Write the page of a run's time series.

    Raises
    ------
    UsageError
        If they cannot be read, or do not come from a run.
    MissingExtraError
        If xarray or MuJoCo is absent.
    """
    page = imported("view", "spikeport.experiments.viewer.page", "runs")
    with _readable(probes):
        page.write_page(path, read_dataset(probes), title)


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Refuse time series that cannot be read, or do not come from a run."""
    try:
        yield
    except UsageError:
        raise
    except OSError as error:
        # An error that names another file comes from writing that file.
        if error.filename is not None and not Path(error.filename).is_relative_to(path):
            raise
        raise UsageError(f"{path}: cannot be read ({shown(error)})") from None
    except (MismatchError, *MALFORMED) as error:
        raise UsageError(f"{path}: cannot be read ({shown(error)})") from None
