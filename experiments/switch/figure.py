"""The figure of a switching run, after the paper's Figs. 1 and 6.

Above are the robot in every phase, if pictures can be drawn, and the work of its arm. Below, over
time, are phases and spikes (`spikeport.experiments.switch.nuclei_figure`), with a switch in
milliseconds beside them; dotted lines lead from each picture to its moment. At the bottom is the
robot's way.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import ConnectionPatch

from spikeport.constants import DT_S
from spikeport.experiments.pictures import cores_of, show_picture
from spikeport.experiments.run_folder import Result
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.switch.nuclei_figure import (
    AFTER_S,
    BEFORE_S,
    NUCLEI,
    Window,
    draw_nuclei,
    name_nuclei,
)
from spikeport.experiments.switch.picture import COLOURS, middles
from spikeport.experiments.switch.recording import SwitchRun
from spikeport.experiments.switch.work_figure import TEMPLATE, draw_work
from spikeport.experiments.walk.port import LEAD_S
from spikeport.plots import legend_once

MOMENT = "0.35"
COLUMNS, OVER_TIME = 16, slice(0, 12)
BESIDE = slice(13, COLUMNS)


def switch_figure(run: SwitchRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
    """Draw the figure; ``result`` is the content of ``result.json``.

    ``pictures`` (height, width, 3) show the robot in the middle of each phase.
    """
    rows = [*NUCLEI] if run.spikes else ["strD1", "gpi"]
    figure = Figure(figsize=(17, 8.6 + 1.2 * len(rows)))
    heights = [3.6, 0.5, *[1.1] * len(rows), 0.25, 1.2]
    margins = {"left": 0.075, "right": 0.965, "top": 0.95, "bottom": 0.05}
    grid = figure.add_gridspec(
        len(heights), COLUMNS, height_ratios=heights, hspace=0.12, wspace=0.1, **margins
    )
    over_time, beside = (
        {name: figure.add_subplot(grid[2 + i, part]) for i, name in enumerate(rows)}
        for part in (OVER_TIME, BESIDE)
    )
    draw_nuclei(over_time, run, Window.whole(run))
    name_nuclei(over_time)
    over_time["gpi"].set_xlabel("time (s)")
    _draw_switch(beside, run)
    band = figure.add_subplot(grid[1, OVER_TIME])
    _draw_phases(band, run, result)
    shown = list(zip(run.goals, pictures, middles(run), strict=False))
    _show_pictures(figure, grid, [band, *over_time.values()], run.recording.time_s, shown)
    draw_work(figure.add_subplot(grid[0, BESIDE]), run, result["metrics"]["phases"])
    _draw_way(figure.add_subplot(grid[-1, :]), run)
    figure.suptitle(_title(result), x=0.075, y=0.985, ha="left", fontsize=17, fontweight="bold")
    return figure


def _title(result: Result) -> str:
    figures, settings = result["metrics"], result["settings"]
    held = "anchored" if settings["anchor"] else "free-standing"
    falls = "no fall" if not figures["falls"] else f"fell at {figures['fallen_at_s']:.1f} s"
    return (
        f"switch, {held}, {result['backend']}{cores_of(result)}: {figures['phases_done']} of "
        f"{len(figures['phases'])} phases done, {falls} in {result['seconds']:g} s, "
        f"seed {result['seeds']['run']}"
    )


def _draw_phases(axes: Axes, run: SwitchRun, result: Result) -> None:
    """Draw a bar for each phase: its name, whether it was done, the time of its switch."""
    axes.set(xlim=Window.whole(run).extent, ylim=(0, 1))
    axes.set_axis_off()
    for goal, figures in zip(run.goals, result["metrics"]["phases"], strict=True):
        phase, done = goal.phase, "✓" if figures["success"] else "✗"
        axes.barh(0.5, phase.seconds, 0.9, phase.begin_s, color=COLOURS[phase.action], ec="white")
        switch_s = figures["switching_time_s"]
        switch = "" if not switch_s or phase.begin_s == 0 else f"\nswitch {1000 * switch_s:.0f} ms"
        axes.text(
            phase.begin_s + phase.seconds / 2,
            0.48,
            f"{phase.name} {done}{switch}",
            ha="center",
            va="center",
            color="white",
            fontweight="bold",
            clip_on=True,
        )


def _draw_switch(beside: dict[str, Axes], run: SwitchRun) -> None:
    """Draw the first change of the action, spike by spike; nothing where there is none."""
    begins = [
        goal.phase.begin_s
        for before, goal in zip(run.goals, run.goals[1:], strict=False)
        if goal.phase.action != before.phase.action
    ]
    last_s = len(run.gates) * DT_S - AFTER_S
    # The window around the switch must lie within the run.
    if not begins or not BEFORE_S <= begins[0] <= last_s:
        for axes in beside.values():
            axes.set_axis_off()
        return
    draw_nuclei(beside, run, Window.around(begins[0]))
    beside["strD1"].set_title(f"the switch at {begins[0]:g} s", fontsize=12)
    beside["gpi"].set_xlabel("time from the switch (ms)")


def _show_pictures(
    figure: Figure,
    grid: GridSpec,
    over_time: list[Axes],
    time_s: np.ndarray,
    shown: list[tuple[Goal, np.ndarray, int]],
) -> None:
    """Show pictures of goals, and draw a line from each to the moment of its physics step."""
    whole = grid[0, OVER_TIME].subgridspec(1, max(1, len(shown)), wspace=0.03)
    for number, (goal, picture, step) in enumerate(shown):
        axes = figure.add_subplot(whole[0, number])
        # The middle three fifths, where the robot is.
        side = picture.shape[1] // 5
        show_picture(axes, picture[:, side:-side])
        _label(axes, goal)
        moment_s = time_s[step]
        for below in over_time[1:]:
            below.axvline(moment_s, color=MOMENT, ls=":", lw=1.2)
        corner = (picture.shape[1] / 2 - side, picture.shape[0])
        lead = ConnectionPatch(
            corner, (moment_s, 1.0), "data", "data", axesA=axes, axesB=over_time[0]
        )
        lead.set(color=MOMENT, ls=":", lw=1.2)
        figure.add_artist(lead)


def _label(axes: Axes, goal: Goal) -> None:
    box = {"facecolor": COLOURS[goal.phase.action], "edgecolor": "none", "pad": 4}
    axes.text(
        0.04,
        0.95,
        goal.phase.name,
        transform=axes.transAxes,
        va="top",
        color="white",
        fontweight="bold",
        bbox=box,
    )


def _draw_way(axes: Axes, run: SwitchRun) -> None:
    """Draw the way of the pelvis, and the paths it was to follow."""
    for goal, path in zip(run.goals, run.paths, strict=False):
        if path is not None:
            end_s = goal.phase.seconds + LEAD_S
            way = np.array([path.at(t)[:2] for t in np.linspace(0, end_s, 200)])
            axes.plot(*way.T, color=TEMPLATE, ls="--", lw=1.2, label="path")
    axes.plot(*run.recording.position_m.T, color=COLOURS["walk"], lw=2, label="pelvis")
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.set_adjustable("datalim")
    legend_once(axes, loc="upper left", ncols=2)
