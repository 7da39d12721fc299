"""The figure of a drawing, after the paper's Fig. 5.

Above, the digit as the robot sees it, template and trace, beside a picture of the robot where one
can be drawn; below, the distances of the hand to the target and to the template over time.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.arm.draw_metrics import drawing, shape_error
from spikeport.experiments.arm.draw_task import DrawTask, Sheet
from spikeport.experiments.arm.figure import (
    DISTANCE,
    HAND,
    LIMIT,
    TARGET,
    mark_limits,
    show_picture,
    title,
)
from spikeport.experiments.arm.trial import ArmRun

TRACE = "#c8102e"


def draw_figure(run: ArmRun, sheet: Sheet, stroke: Any, result: dict[str, Any]) -> Figure:
    """The figure; ``result`` is what ``result.json`` will hold."""
    figure = Figure(figsize=(12, 9), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=[2.6, 1])
    wide = run.picture is None
    _draw_digit(figure.add_subplot(grid[0, :] if wide else grid[0, 0]), run, sheet, stroke)
    if run.picture is not None:
        show_picture(figure.add_subplot(grid[0, 1]), run.picture)
    _draw_errors(figure.add_subplot(grid[1, :]), run, stroke)
    achieved = f"{1000 * result['metrics']['shape_error_rms_m']:.1f} mm from the template (rms)"
    figure.suptitle(title(result, f"digit {result['settings']['digit']}", achieved))
    return figure


def _draw_digit(axes: Axes, run: ArmRun, sheet: Sheet, stroke: Any) -> None:
    drawn, down = drawing(run.recording), run.recording.time_s >= DrawTask.begin_s
    template, trace = 100 * sheet.read(stroke), 100 * sheet.read(drawn.hand)
    target = 100 * sheet.read(drawn.target)
    axes.plot(*template.T, color="0.25", ls="--", lw=1.4, label="template")
    axes.plot(*target[::100].T, ".", color=TARGET, ms=5, label="target, every 0.5 s")
    axes.plot(*trace.T, color=TRACE, lw=1.8, label="hand")
    at_limit = run.at_limit[down]
    if at_limit.any():
        axes.plot(*trace[at_limit].T, "x", color=LIMIT, label="joint at its limit")
    axes.set(xlabel="to the robot's right (cm)", ylabel="up (cm)", aspect="equal")
    axes.margins(0.12)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)


def _draw_errors(axes: Axes, run: ArmRun, stroke: Any) -> None:
    recording, drawn = run.recording, drawing(run.recording)
    apart = shape_error(stroke, drawn.hand)
    axes.axvspan(0, DrawTask.begin_s, color="0.93", label="approach")
    axes.plot(recording.time_s, 1000 * recording.distance_m, color=DISTANCE, lw=1.2, label="target")
    axes.plot(drawn.time_s, 1000 * apart, color=HAND, lw=1.2, label="template")
    mark_limits(axes, run)
    axes.set(ylabel="distance of the hand to (mm)", xlabel="time (s)", ylim=(0, None))
    axes.set_xlim(0, recording.time_s[-1])
    axes.legend(loc="upper right", framealpha=0.9)
