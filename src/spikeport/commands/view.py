"""``spikeport view RUN``: a finished run as a page, which plays it in a browser."""

from pathlib import Path

from spikeport.errors import UsageError
from spikeport.experiments.registry import imported
from spikeport.files import read_json
from spikeport.reading.hdf5 import read_dataset
from spikeport.reading.mismatch import MismatchError, shown

PAGE = "view.html"
MALFORMED = (AttributeError, ValueError, TypeError, LookupError)
"""Errors of drawing time series that are not those of a run."""


def run(folder: Path, out: Path | None) -> None:
    """Write the page of a run.

    Raises
    ------
    UsageError
        If the folder holds no finished run, or its time series cannot be read.
    MissingExtraError
        If xarray or MuJoCo is absent.
    """
    result = read_json(folder / "result.json")
    if not isinstance(result, dict) or not (folder / "probes.nc").is_file():
        raise UsageError(f"{folder}: no finished run; cure: name a folder that `run` has written")
    path = out or folder / PAGE
    write(folder / "probes.nc", path, f"{result.get('experiment', 'run')}: {folder}")
    print(f"written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")


def write(probes: Path, path: Path, title: str) -> None:
    """Write the page of a run's time series.

    Raises
    ------
    UsageError
        If they cannot be read, or are not those of a run.
    MissingExtraError
        If xarray or MuJoCo is absent.
    """
    page = imported("view", "spikeport.experiments.viewer.page")
    try:
        page.write_page(path, read_dataset(probes), title)
    except (MismatchError, OSError, *MALFORMED) as error:
        raise UsageError(f"{probes}: cannot be read ({shown(error)})") from None
