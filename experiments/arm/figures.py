"""The figures of reach runs and drawings, after the paper's Figs. 3 and 4."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.arm.draw_task import DrawTask, Sheet, pen_is_down
from spikeport.experiments.arm.metrics import drawing, shape_error
from spikeport.experiments.arm.reach_task import REACHED_M
from spikeport.experiments.arm.recording import ArmRun
from spikeport.experiments.pictures import cores_of, show_picture
from spikeport.experiments.run_folder import Result

HAND, TARGET, ERROR, DISTANCE = "#2a9d4a", "#e8871e", "#5b6fd6", "#1f9aa0"
SPIKES, LIMIT, TRACE = "#44474d", "#c62828", "#c8102e"


def reach_figure(run: ArmRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
    """Draw a reach run; ``result`` is the content of ``result.json``.

    Above, the distance of hand and target over time, beside a picture of the robot where one can be
    drawn; below, for each axis, the spikes of M1, with hand, error and target over them.
    """
    figure = Figure(figsize=(12, 10), layout="constrained")
    grid = figure.add_gridspec(4, 3, height_ratios=[1.6, 1, 1, 1])
    _draw_distance(figure.add_subplot(grid[0, :2] if pictures else grid[0, :]), run)
    for picture in pictures:
        show_picture(figure.add_subplot(grid[0, 2]), picture)
    for d, name in enumerate("xyz"):
        axes = figure.add_subplot(grid[1 + d, :])
        _draw_axis(axes, run, d, name)
    axes.set_xlabel("time (s)")
    for axes in figure.axes:
        if axes.axison:
            axes.set_xlim(0, result["seconds"])
    task = f"reach, {result['settings']['box']} box"
    figure.suptitle(_title(result, task, f"{result['metrics']['reaches']} reaches"))
    return figure


def draw_figure(
    run: ArmRun,
    sheet: Sheet,
    stroke: np.ndarray,
    pictures: Sequence[np.ndarray],
    result: Result,
) -> Figure:
    """Draw a drawing run of a stroke (n, 3) in m; ``result`` is the content of ``result.json``.

    Above, the digit as the robot sees it, template and trace, beside a picture of the robot where
    one can be drawn; below, the distances of the hand to the target and to the template over time.
    """
    figure = Figure(figsize=(12, 9), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=[2.6, 1])
    above = figure.add_subplot(grid[0, 0] if pictures else grid[0, :])
    _draw_digit(above, run, sheet, stroke)
    for picture in pictures:
        show_picture(figure.add_subplot(grid[0, 1]), picture)
    _draw_errors(figure.add_subplot(grid[1, :]), run, stroke)
    achieved = f"{1000 * result['metrics']['shape_error_rms_m']:.1f} mm from the template (rms)"
    figure.suptitle(_title(result, f"digit {result['settings']['digit']}", achieved))
    return figure


def _title(result: Result, task: str, achieved: str) -> str:
    return (
        f"{task}, {result['backend']}{cores_of(result)}: {achieved} "
        f"in {result['seconds']:g} s, seed {result['seeds']['run']}"
    )


def _draw_distance(axes: Axes, run: ArmRun) -> None:
    recording = run.recording
    axes.plot(recording.time_s, 100 * recording.distance_m, color=DISTANCE, lw=1.2)
    axes.axhline(100 * REACHED_M, color="0.5", ls="--", lw=0.8, label="reached below 4 cm")
    _mark_limits(axes, run)
    axes.set(ylabel="distance to target (cm)", xlabel="time (s)", ylim=(0, None))
    axes.legend(loc="upper right", frameon=False)


def _draw_digit(axes: Axes, run: ArmRun, sheet: Sheet, stroke: np.ndarray) -> None:
    drawn, down = drawing(run.recording), pen_is_down(run.recording.time_s)
    template, trace = 100 * sheet.project(stroke), 100 * sheet.project(drawn.hand)
    target = 100 * sheet.project(drawn.target)
    axes.plot(*template.T, color="0.25", ls="--", lw=1.4, label="template")
    axes.plot(*target[::100].T, ".", color=TARGET, ms=5, label="target, every 0.5 s")
    axes.plot(*trace.T, color=TRACE, lw=1.8, label="hand")
    at_limit = run.at_limit[down]
    if at_limit.any():
        axes.plot(*trace[at_limit].T, "x", color=LIMIT, label="joint at its limit")
    axes.set(xlabel="to the robot's right (cm)", ylabel="up (cm)", aspect="equal")
    axes.margins(0.12)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)


def _draw_errors(axes: Axes, run: ArmRun, stroke: np.ndarray) -> None:
    recording, drawn = run.recording, drawing(run.recording)
    errors_m = shape_error(stroke, drawn.hand)
    axes.axvspan(0, DrawTask.begin_s, color="0.93", label="approach")
    axes.plot(
        recording.time_s, 1000 * recording.distance_m, color=DISTANCE, lw=1.2, label="to target"
    )
    axes.plot(drawn.time_s, 1000 * errors_m, color=HAND, lw=1.2, label="to template")
    _mark_limits(axes, run)
    axes.set(ylabel="distance of the hand (mm)", xlabel="time (s)", ylim=(0, None))
    axes.set_xlim(0, recording.time_s[-1])
    axes.legend(loc="upper right", framealpha=0.9)


def _mark_limits(axes: Axes, run: ArmRun) -> None:
    """Draw ticks along the time axis where a joint was at its lowest or highest angle."""
    times = run.recording.time_s[run.at_limit]
    if len(times):
        label = f"joint at its limit (steps: {len(times)})"
        axes.plot(times, np.zeros(len(times)), "|", color=LIMIT, ms=12, label=label)


def _draw_axis(axes: Axes, run: ArmRun, d: int, name: str) -> None:
    """Draw spikes of M1 of one axis, with hand, error and target over them (paper, Fig. 3b)."""
    recording = run.recording
    times, hand, target = recording.time_s, recording.hand[:, d], recording.target[:, d]
    if name in run.rasters:
        _draw_spikes(axes, times, run.rasters[name], target - hand)
    axes.set_ylabel(f"M1 {name} neuron")
    middle = (target.min() + target.max()) / 2
    position = axes.twinx()
    position.plot(times, hand - middle, color=HAND, lw=1.6, label="hand")
    position.plot(times, target - hand, color=ERROR, lw=1.0, label="error")
    position.step(times, target - middle, color=TARGET, ls=":", lw=1.6, label="target")
    position.set_ylabel(f"{name} relative to {middle:.2f} m (m)")
    if d == 0:
        position.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)


def _draw_spikes(axes: Axes, times: np.ndarray, spikes: np.ndarray, error: np.ndarray) -> None:
    step, neuron = np.nonzero(_by_tuning(spikes, error))
    seconds = np.interp(step, np.linspace(0, len(spikes), len(times)), times)
    axes.scatter(seconds, neuron, s=0.6, color=SPIKES, marker="|", linewidths=0.5, alpha=0.6)


def _by_tuning(spikes: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the spikes with neurons sorted by their covariance with the error along the axis."""
    # A physics step is longer than a neuron's step: several steps have the same error.
    per_sample = error[np.arange(len(spikes)) * len(error) // len(spikes)]
    covariance = (per_sample - per_sample.mean()) @ spikes
    return spikes[:, np.argsort(covariance)]
