"""The figure of a reach run, after the paper's Fig. 4.

Above, the distance of hand and target over time, beside a picture of the robot where one can be
drawn; below, for each axis, the spikes of M1, with hand, error and target over them.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.arm.figure import DISTANCE, draw_axis, mark_limits, show_picture, title
from spikeport.experiments.arm.reach_task import REACHED_M
from spikeport.experiments.arm.trial import ArmRun


def reach_figure(run: ArmRun, result: dict[str, Any]) -> Figure:
    """The figure; ``result`` is what ``result.json`` will hold."""
    figure = Figure(figsize=(12, 10), layout="constrained")
    grid = figure.add_gridspec(4, 3, height_ratios=[1.6, 1, 1, 1])
    wide = run.picture is None
    _draw_distance(figure.add_subplot(grid[0, :] if wide else grid[0, :2]), run)
    if run.picture is not None:
        show_picture(figure.add_subplot(grid[0, 2]), run.picture)
    for d, name in enumerate("xyz"):
        axes = figure.add_subplot(grid[1 + d, :])
        draw_axis(axes, run, d, name)
    axes.set_xlabel("time (s)")
    for axes in figure.axes:
        if axes.axison:
            axes.set_xlim(0, result["seconds"])
    task = f"reach, {result['settings']['box']} box"
    figure.suptitle(title(result, task, f"{result['metrics']['reaches']} reaches"))
    return figure


def _draw_distance(axes: Axes, run: ArmRun) -> None:
    recording = run.recording
    axes.plot(recording.time_s, 100 * recording.distance_m, color=DISTANCE, lw=1.2)
    axes.axhline(100 * REACHED_M, color="0.5", ls="--", lw=0.8, label="reached below 4 cm")
    mark_limits(axes, run)
    axes.set(ylabel="distance to target (cm)", xlabel="time (s)", ylim=(0, None))
    axes.legend(loc="upper right", frameon=False)
