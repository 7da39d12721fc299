"""The paper's Fig. 6a: where the robot walked with either policy, over the ideal path."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.settings import WalkSettings

IDEAL = "black"
COLORS = {"mlp": "#1f9aa0", "spiking": "#e8871e"}
LABELS = {"mlp": "reference policy", "spiking": "spiking policy"}
FELL = "#c62828"
PATH_DT_S = 0.05


def figure(sweep: Sweep, folder: SweepFolder, table: xr.Dataset) -> Figure:
    """Draw a sweep over ``policy`` that keeps its probes."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    axes = figure.subplots()
    _draw_ideal(axes, sweep)
    for point in sweep.points():
        if folder.holds(point):
            _draw_trace(axes, folder, point)
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.set_adjustable("datalim")
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(once.values(), once.keys(), frameon=False)
    figure.suptitle(_title(sweep, table))
    return figure


def _draw_ideal(axes: Axes, sweep: Sweep) -> None:
    settings = WalkSettings(**sweep.points()[0].settings)
    path = find_path(settings.path, settings.speed, sweep.seconds)
    places = [path.at(t)[:2] for t in np.arange(0, sweep.seconds + PATH_DT_S, PATH_DT_S)]
    axes.plot(*np.transpose(places), color=IDEAL, lw=2, label="ideal path")


def _draw_trace(axes: Axes, folder: SweepFolder, point: Point) -> None:
    policy = point.settings["policy"]
    with xr.open_dataset(folder.probes_path(point), engine="h5netcdf") as probes:
        place = probes.state.sel(turned=["x", "y"]).values
    axes.plot(*place.T, color=COLORS[policy], lw=1, alpha=0.8, label=LABELS[policy])
    if folder.read(point)["metrics"]["falls"]:
        axes.plot(*place[-1], "X", color=FELL, ms=10, label="fell")


def _title(sweep: Sweep, table: xr.Dataset) -> str:
    apart = 100 * table.cross_track_rms_m.median("seed")
    both = ", ".join(f"{LABELS[str(p)]} {apart.sel(policy=p):.1f} cm" for p in table.policy.values)
    return (
        f"walk on {sweep.backend}, {sweep.seconds:g} s, seeds: {len(sweep.seeds)}\n"
        f"median distance from the path (rms): {both}"
    )
