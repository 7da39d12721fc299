"""The figure of a sweep: a row of panels for each metric, over the settings that are varied.

The first varied setting is the abscissa, the second has a line for each value, and every
combination of the others has a column. Lines are means over the seeds, and bands reach from the
smallest to the largest value.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import SEED, Sweep
from spikeport.plots import plain

LOG_RATIO = 30.0
"""The ratio of largest to smallest value above which the scale is logarithmic."""

MOST_PANELS = 60
"""The most panels of a figure, which take about 10 s; the first columns are drawn."""


def figure(sweep: Sweep, _folder: SweepFolder, table: xr.Dataset) -> Figure:
    """Draw all metrics."""
    return metrics_figure(sweep, table, [str(name) for name in table.data_vars])


def metrics_figure(sweep: Sweep, table: xr.Dataset, metrics: Sequence[str]) -> Figure:
    """Draw some metrics; ``table`` is the dataset of `spikeport.experiments.sweep.table`."""
    over, *keys = sweep.varied or (SEED,)
    everywhere = list(_places(table, keys[1:]))
    n_panels, metrics = len(metrics) * len(everywhere), metrics[:MOST_PANELS]
    places = everywhere[: max(1, MOST_PANELS // len(metrics))]
    left_out = n_panels - len(metrics) * len(places)
    width, height = max(6.4, 4.6 * len(places)), 1 + 3 * len(metrics)
    figure = Figure(figsize=(width, height), layout="constrained")
    grid = figure.subplots(len(metrics), len(places), squeeze=False, sharex=True, sharey="row")
    for row, metric in zip(grid, metrics, strict=True):
        for axes, place in zip(row, places, strict=True):
            _draw_panel(axes, table[metric].sel(place), over, keys[:1])
        row[0].set_ylabel(metric)
        row[0].set_yscale(_scale(table[metric]))
    for axes, place in zip(grid[0], places, strict=True):
        axes.set_title(_text(place))
    for axes in grid[-1]:
        axes.set_xlabel(over)
    if keys:
        grid[0][0].legend(title=keys[0], frameon=False)
    figure.suptitle(_title(sweep) + (f"; {left_out:,} panels left out" if left_out else ""))
    return figure


def _places(table: xr.Dataset, keys: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield every combination of the values of some dimensions."""
    for values in itertools.product(*(table[key].values for key in keys)):
        yield dict(zip(keys, values, strict=True))


def _title(sweep: Sweep) -> str:
    on = "" if "backend" in sweep.varied else f" on {sweep.backend}"
    lasts = " or ".join(f"{seconds:g}" for seconds in sweep.lasts)
    return f"{sweep.experiment}{on}, {lasts} s, seeds: {len(sweep.seeds)}"


def _draw_panel(axes: Axes, values: xr.DataArray, over: str, key: Sequence[str]) -> None:
    lines = list(_places(values.to_dataset(name="values"), key))
    colors = colormaps["viridis"](np.linspace(0, 0.85, len(lines)))
    for place, color in zip(lines, colors, strict=True):
        _draw_line(axes, values.sel(place), over, color, _text(place, named=False))
    if _is_text(values[over]):
        axes.set_xticks(range(values.sizes[over]), [plain(text) for text in values[over].values])


def _draw_line(axes: Axes, values: xr.DataArray, over: str, color: Any, label: str) -> None:
    seeds = [name for name in values.dims if name != over]
    if _is_text(values[over]):  # texts have no scale: they are evenly spaced, in their order
        at = np.arange(values.sizes[over])
    else:
        values = values.sortby(over)
        at = values[over].values
    axes.plot(at, values.mean(seeds), "o-", color=color, label=label)
    axes.fill_between(at, values.min(seeds), values.max(seeds), color=color, alpha=0.2, lw=0)


def _is_text(coordinate: xr.DataArray) -> bool:
    return coordinate.dtype.kind not in "if"


def _scale(values: xr.DataArray) -> str:
    found = values.values[np.isfinite(values.values)]
    wide = len(found) and found.min() > 0 and found.max() > LOG_RATIO * found.min()
    return "log" if wide else "linear"


def _text(place: dict[str, Any], named: bool = True) -> str:
    # With all digits: two seeds of networks may differ in the last of ten.
    values = {
        k: f"{v:.15g}" if isinstance(v, int | float | np.number) else v for k, v in place.items()
    }
    return plain(", ".join(f"{k}={v}" if named else str(v) for k, v in values.items()))
