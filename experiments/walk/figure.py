"""The figure of a walking run, after the paper's Fig. 5.

At the top are path and trace from above, beside a picture of the robot if one can be drawn. Below,
over time, are commands and motion, the distance from the path, and the gait: the height of the
pelvis, and the feet on the floor.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.pictures import cores_of, show_picture
from spikeport.experiments.run_folder import Result
from spikeport.experiments.walk.metrics import smoothed
from spikeport.experiments.walk.recording import WalkRecording, WalkRun
from spikeport.robot.feet import SIDES
from spikeport.robot.walk_interface import LOWEST_PELVIS_M

TRACE, REFERENCE, COMMAND, DISTANCE = "#2a9d4a", "#44474d", "#e8871e", "#1f9aa0"
FELL = "#c62828"


def walk_figure(run: WalkRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
    """Draw the figure; ``result`` is the content of ``result.json``."""
    figure = Figure(figsize=(12, 12), layout="constrained")
    grid = figure.add_gridspec(6, 3, height_ratios=[3.2, 1, 1, 1, 0.8, 0.5])
    _draw_path(figure.add_subplot(grid[0, :2] if pictures else grid[0, :]), run)
    for picture in pictures:
        show_picture(figure.add_subplot(grid[0, 2]), picture)
    over_time = [figure.add_subplot(grid[row, :]) for row in range(1, 6)]
    recording = run.recording
    _draw_command(over_time[0], recording, 0, recording.speed_m_s, "speed (m/s)")
    _draw_command(over_time[1], recording, 1, recording.yaw_rate_rad_s, "yaw rate (rad/s)")
    _draw_distance(over_time[2], run)
    _draw_height(over_time[3], recording)
    _draw_feet(over_time[4], recording)
    for axes in over_time:
        axes.set_xlim(0, recording.time_s[-1])
        if run.fallen_at_s is not None:
            axes.axvline(run.fallen_at_s, color=FELL, lw=2)
    over_time[-1].set_xlabel("time (s)")
    figure.suptitle(_title(result))
    return figure


def _title(result: Result) -> str:
    settings, figures = result["settings"], result["metrics"]
    fell = f"fell at {figures['fallen_at_s']:.1f} s" if figures["falls"] else "no fall"
    return (
        f"walk, {settings['path']}, {result['backend']}{cores_of(result)}: {fell}, "
        f"{100 * figures['cross_track_rms_m']:.1f} cm rms from the path in "
        f"{result['seconds']:g} s, seed {result['seeds']['run']}"
    )


def _draw_path(axes: Axes, run: WalkRun) -> None:
    recording = run.recording
    axes.plot(*recording.reference[:, :2].T, color=REFERENCE, lw=1.0, ls="--", label="reference")
    axes.plot(*recording.position_m.T, color=TRACE, lw=1.6, label="pelvis")
    axes.plot(*recording.position_m[0], "o", color=TRACE, label="start")
    if run.fallen_at_s is not None:
        axes.plot(*recording.position_m[-1], "X", color=FELL, ms=12, label="fell")
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.set_adjustable("datalim")
    axes.legend(loc="best", frameon=False)


def _draw_command(
    axes: Axes, recording: WalkRecording, which: int, motion: np.ndarray, label: str
) -> None:
    axes.plot(recording.time_s, smoothed(motion), color=TRACE, label="robot")
    axes.plot(recording.time_s, recording.command[:, which], color=COMMAND, lw=0.8, label="command")
    axes.set_ylabel(label)
    axes.legend(loc="lower right", ncols=2, frameon=False)


def _draw_distance(axes: Axes, run: WalkRun) -> None:
    distance_m = run.path.distances_m(run.recording.position_m)
    axes.plot(run.recording.time_s, 100 * distance_m, color=DISTANCE)
    axes.set(ylabel="distance\nfrom path (cm)", ylim=(0, None))


def _draw_height(axes: Axes, recording: WalkRecording) -> None:
    axes.plot(recording.time_s, recording.height_m, color=DISTANCE, lw=0.8)
    axes.set(ylabel="pelvis\nheight (m)", ylim=(min(0.85, LOWEST_PELVIS_M), 1.1))


def _draw_feet(axes: Axes, recording: WalkRecording) -> None:
    """Draw a bar for each foot while it is on the floor."""
    extent = (0, recording.time_s[-1], -0.5, len(SIDES) - 0.5)
    # Images count rows from the top, the axis from the bottom.
    on_floor = recording.on_floor.T[::-1]
    axes.imshow(on_floor, aspect="auto", cmap="Greys", extent=extent, interpolation="nearest")
    axes.set_yticks(range(len(SIDES)), [f"{side} foot" for side in SIDES])
