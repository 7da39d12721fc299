"""The figure of a switching run, after the paper's Figs. 1 and 6.

Above, the robot in every phase, where pictures can be drawn; below, over time, the spikes of strD1
with the utilities over them, of strD2 and STN, and of GPi with the gates over them: what is not
selected is closed. Dashed lines lead from each picture to its moment. At the bottom, where the
robot went, and what it drew.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch
from matplotlib.patheffects import Normal, Stroke

from spikeport.experiments.arm.draw_metrics import drawing
from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.arm.figure import show_picture
from spikeport.experiments.closed_loop import DT_S
from spikeport.experiments.switch.phases import arm_in
from spikeport.experiments.switch.picture import middles
from spikeport.experiments.switch.trial import SwitchRun
from spikeport.networks.humanoid import ACTIONS

NUCLEI = {"strD1": "strD1", "strD2": "strD2", "stn": "STN", "gpi": "GPi"}
COLOURS = dict(zip(ACTIONS, ("#2a9d4a", "#c8102e"), strict=True))
TEMPLATE, MOMENT = "0.25", "0.45"
SPIKE_ALPHA = 0.2
HALO = [Stroke(linewidth=4, foreground="white"), Normal()]
"""Around lines that lie over spikes of their colour."""
SMOOTHED_S = 0.02
"""Gates are averaged over this time."""


def switch_figure(run: SwitchRun, result: dict[str, Any]) -> Figure:
    """The figure; ``result`` is what ``result.json`` will hold."""
    shown = {name: raster for name, raster in run.spikes.items() if name in NUCLEI}
    rows = [*NUCLEI] if shown else ["strD1", "gpi"]
    figure = Figure(figsize=(14, 9 + len(rows)), layout="constrained")
    grid = figure.add_gridspec(len(rows) + 2, 12, height_ratios=[2.6, *[1] * len(rows), 2.2])
    over_time = [figure.add_subplot(grid[1 + i, :]) for i in range(len(rows))]
    for axes, name in zip(over_time, rows, strict=True):
        _draw_nucleus(axes, run, name)
    over_time[-1].set_xlabel("time (s)")
    _draw_utilities(over_time[0], run)
    _draw_gates(over_time[-1], run)
    _show_pictures(figure, grid, over_time, run)
    _draw_way(figure.add_subplot(grid[-1, :7]), run)
    _draw_digits(figure.add_subplot(grid[-1, 7:]), run)
    figure.suptitle(_title(result))
    return figure


def _title(result: dict[str, Any]) -> str:
    """What was done, on what, and how well."""
    figures, settings = result["metrics"], result["settings"]
    cores = "" if result["resources"] is None else f", {result['resources']['cores']['used']} cores"
    done = sum(phase["success"] for phase in figures["phases"])
    held = "anchored" if settings["anchor"] else "free-standing"
    return (
        f"switch, {held}, {result['backend']}{cores}: {done} of {len(figures['phases'])} phases, "
        f"{figures['falls']} falls in {result['seconds']:g} s, seed {result['seeds']['run']}"
    )


def _draw_nucleus(axes: Axes, run: SwitchRun, name: str) -> None:
    """The spikes of a nucleus, those of each action in its colour."""
    axes.set(ylabel=NUCLEI[name], xlim=(0, run.recording.time_s[-1]), yticks=[])
    if name not in run.spikes:
        return
    raster = run.spikes[name]
    step, neuron = np.nonzero(raster)
    size = raster.shape[1] // len(ACTIONS)
    for number, action in enumerate(ACTIONS):
        own = neuron // size == number
        axes.plot(step[own] * DT_S, neuron[own], ",", alpha=SPIKE_ALPHA, color=COLOURS[action])
    axes.set_ylim(-1, raster.shape[1])


def _draw_utilities(axes: Axes, run: SwitchRun) -> None:
    phases = [goal.phase for goal in run.goals]
    times = [phase.begin_s for phase in phases] + [phases[-1].end_s]
    values = np.array([phase.values for phase in phases])
    over = _over(axes, "utility")
    over.set_ylim(-0.05, 1.3)
    for action, utility in zip(ACTIONS, values.T, strict=True):
        line = over.stairs(utility, times, baseline=None, color=COLOURS[action], lw=2, label=action)
        line.set_path_effects(HALO)
    for phase in phases:
        over.annotate(f" {phase.name}", (phase.begin_s, 1.08))
    over.legend(loc="upper right", ncols=2, framealpha=0.9)


def _draw_gates(axes: Axes, run: SwitchRun) -> None:
    """What inhibits each action: 1 while its gate is closed."""
    over, width = _over(axes, "closed"), round(SMOOTHED_S / DT_S)
    gates = run.gates[: len(run.gates) // width * width].reshape(-1, width, len(ACTIONS)).mean(1)
    time_s = (np.arange(len(gates)) + 0.5) * SMOOTHED_S
    for action, gate in zip(ACTIONS, gates.T, strict=True):
        over.plot(time_s, 1 - gate, color=COLOURS[action], lw=2, path_effects=HALO)


def _over(axes: Axes, label: str) -> Axes:
    over = axes.twinx()
    over.set(ylabel=label, ylim=(-0.05, 1.1))
    return over


def _show_pictures(figure: Figure, grid: Any, over_time: list[Axes], run: SwitchRun) -> None:
    width = 12 // max(1, len(run.pictures))
    for number, (picture, step) in enumerate(zip(run.pictures, middles(run), strict=False)):
        axes = figure.add_subplot(grid[0, number * width : (number + 1) * width])
        side = picture.shape[1] // 5
        show_picture(axes, picture[:, side:-side])
        moment_s = run.recording.time_s[step]
        for below in over_time:
            below.axvline(moment_s, color=MOMENT, ls="--", lw=1)
        top, bottom = (picture.shape[1] / 2 - side, picture.shape[0]), (moment_s, 1.0)
        lead = ConnectionPatch(
            top,
            bottom,
            axes.transData,
            over_time[0].get_xaxis_transform(),
            axesA=axes,
            axesB=over_time[0],
            color=MOMENT,
            ls="--",
            lw=1,
        )
        figure.add_artist(lead)


def _draw_way(axes: Axes, run: SwitchRun) -> None:
    """The way of the pelvis, and the paths it was to take."""
    for goal, path in zip(run.goals, run.paths, strict=False):
        if path is not None:
            way = np.array([path.at(t)[:2] for t in np.linspace(0, goal.phase.seconds, 200)])
            axes.plot(*way.T, color=TEMPLATE, ls="--", lw=1)
    axes.plot(*run.recording.position_m.T, color=COLOURS["walk"], lw=1.6)
    axes.set(xlabel="x of the pelvis (m)", ylabel="y (m)", aspect="equal")
    axes.set_adjustable("datalim")


def _draw_digits(axes: Axes, run: SwitchRun) -> None:
    """Every drawing as the robot sees it, and its template."""
    sheet = Sheet()
    for goal in run.goals[: len(run.paths)]:
        if goal.phase.arm == "digit":
            hand = drawing(arm_in(run, goal.phase)).hand
            axes.plot(*(100 * sheet.read(goal.stroke)).T, color=TEMPLATE, ls="--", lw=1.2)
            axes.plot(*(100 * sheet.read(hand)).T, color=COLOURS["draw"], lw=1.8)
    axes.set(xlabel="hand, to the robot's right (cm)", ylabel="up (cm)", aspect="equal")
    axes.set_adjustable("datalim")
