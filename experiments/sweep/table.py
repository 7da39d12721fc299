"""A sweep's table: every metric that is a number, over settings and seeds."""

from typing import Any

import pandas as pd
import xarray as xr

from spikeport.errors import printable
from spikeport.experiments.run_folder import write_dataset
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import BACKEND, Sweep


def table(sweep: Sweep, folder: SweepFolder) -> xr.Dataset:
    """Return metrics with the sweep's axes as dimensions; NaN where a point is not finished."""
    rows = [
        {**_labels(point.place), **_numbers(result["metrics"])}
        for point, result in folder.read_finished(sweep.points())
    ]
    dataset = pd.DataFrame(rows).set_index(list(sweep.axes)).astype(float).to_xarray()
    asked = {key: [_label(value) for value in values] for key, values in sweep.axes.items()}
    # The times of the points: a run may end with its schedule, before the time that is asked for.
    (longest, *others) = reversed(sweep.lasts)
    whole: xr.Dataset = dataset.reindex(asked).assign_attrs(
        experiment=sweep.experiment,
        **({} if BACKEND in sweep.axes else {BACKEND: sweep.backend}),
        seconds=sweep.lasts if others else longest,
    )
    return whole


def _labels(place: Any) -> dict[str, Any]:
    return {key: _label(value) for key, value in place.items()}


def _label(value: Any) -> Any:
    """Return a value as a coordinate: a number or a text."""
    return printable(str(value)) if isinstance(value, bool | str) else value


def _numbers(metrics: dict[str, Any]) -> dict[str, float | None]:
    return {k: v for k, v in metrics.items() if v is None or isinstance(v, int | float)}


def write_table(folder: SweepFolder, dataset: xr.Dataset) -> None:
    """Write ``table.nc``."""
    write_dataset(folder.path / "table.nc", dataset)
