"""The paper's Fig. 5a: the way of the robot with each policy, over the ideal path."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.errors import UsageError
from spikeport.experiments.policy.settings import EXACT, SPIKING
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Point, Sweep
from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.port import LEAD_S
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.plots import legend_once
from spikeport.reading.hdf5 import read_dataset
from spikeport.reading.mismatch import MismatchError, shown

IDEAL = "black"
COLORS = {EXACT: "#1f9aa0", SPIKING: "#e8871e"}
LABELS = {EXACT: "reference policy", SPIKING: "spiking policy"}
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
    legend_once(axes)
    figure.suptitle(_title(sweep, table))
    return figure


def _draw_ideal(axes: Axes, sweep: Sweep) -> None:
    settings = WalkSettings(**sweep.points()[0].settings)
    seconds = sweep.seconds + LEAD_S
    path = find_path(settings.path, settings.speed, seconds, settings.ramp)
    places = [path.at(t)[:2] for t in np.arange(0, seconds + PATH_DT_S, PATH_DT_S)]
    axes.plot(*np.transpose(places), color=IDEAL, lw=2, label="ideal path")


def _draw_trace(axes: Axes, folder: SweepFolder, point: Point) -> None:
    policy, place = point.settings["policy"], _places(folder, point)
    axes.plot(*place.T, color=COLORS[policy], lw=1, alpha=0.8, label=LABELS[policy])
    if folder.read(point)["metrics"].get("falls"):
        axes.plot(*place[-1], "X", color=FELL, ms=10, label="fell")


def _places(folder: SweepFolder, point: Point) -> np.ndarray:
    """Return the robot's places, (n, 2) in m; raises UsageError if their file was altered."""
    path = folder.probes_path(point)
    try:
        state = read_dataset(path).state.transpose("time", "turned")
        places: np.ndarray = state.sel(turned=["x", "y"]).values.astype(float)
        places[-1]  # a walk has a last place
        return places
    except (MismatchError, OSError, AttributeError, ValueError, LookupError) as error:
        raise UsageError(
            f"{path}: holds no time series of a walk ({shown(error)}); remove "
            f"{folder.result_path(point)} to run its point again"
        ) from error


def _title(sweep: Sweep, table: xr.Dataset) -> str:
    rms_cm = 100 * table.cross_track_rms_m.median("seed")
    both = ", ".join(f"{LABELS[str(p)]} {rms_cm.sel(policy=p):.1f} cm" for p in table.policy.values)
    return (
        f"walk on {sweep.backend}, {sweep.seconds:g} s, seeds: {len(sweep.seeds)}\n"
        f"median distance from the path (rms): {both}"
    )
