"""``spikeport view RUN``: a finished run as a page, which plays it in a browser."""

from pathlib import Path

from spikeport.errors import UsageError
from spikeport.experiments.registry import imported
from spikeport.files import read_json

PAGE = "view.html"


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
    xarray = imported("view", "xarray")
    page = imported("view", "spikeport.experiments.viewer.page")
    try:
        with xarray.open_dataset(folder / "probes.nc", engine="h5netcdf") as probes:
            path = out or folder / PAGE
            page.write_page(path, probes.load(), f"{result.get('experiment', 'run')}: {folder}")
    except (OSError, ValueError, KeyError) as error:
        reason = " ".join(str(error).split())
        raise UsageError(f"{folder / 'probes.nc'}: cannot be read ({reason})") from None
    print(f"written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
