"""The figure of a reach run, after the paper's Fig. 4.

Above, the distance of hand and target over time, beside a picture of the robot where one can be
drawn; below, for each axis, the spikes of M1, with the hand (green) and the target (orange) over
them.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.atomic import atomic_path
from spikeport.experiments.arm_loop import Recording
from spikeport.experiments.reach_task import REACHED_M

HAND, TARGET, DISTANCE, SPIKES = "#2a9d4a", "#e8871e", "#1f9aa0", "#44474d"


def draw(
    folder: Path,
    recording: Recording,
    rasters: dict[str, np.ndarray],
    result: dict[str, Any],
    picture: np.ndarray | None,
) -> None:
    """Write ``figure.png``.

    Parameters
    ----------
    folder : Path
        Where to.
    recording : Recording
        The run.
    rasters : dict of (n_steps, n_neurons) bool array
        Spikes of some M1 neurons, by axis; empty for a controller without neurons.
    result : dict
        What ``result.json`` will hold: its figures stand in the title.
    picture : (height, width, 3) uint8 array, optional
        The robot.
    """
    figure = Figure(figsize=(12, 10), layout="constrained")
    grid = figure.add_gridspec(4, 3, height_ratios=[1.6, 1, 1, 1])
    wide = picture is None
    _draw_distance(figure.add_subplot(grid[0, :] if wide else grid[0, :2]), recording)
    if picture is not None:
        axes = figure.add_subplot(grid[0, 2])
        axes.imshow(picture)
        axes.set_axis_off()
    for d, axis in enumerate("xyz"):
        axes = figure.add_subplot(grid[1 + d, :])
        _draw_axis(axes, recording, d, rasters.get(axis), axis)
    axes.set_xlabel("time (s)")
    for axes in figure.axes:
        if axes.axison:
            axes.set_xlim(0, result["seconds"])
    figure.suptitle(_title(result))
    with atomic_path(folder / "figure.png") as temporary:
        figure.savefig(temporary, dpi=110, format="png")


def _title(result: dict[str, Any]) -> str:
    metrics, settings = result["metrics"], result["settings"]
    cores = "" if result["resources"] is None else f", {result['resources']['cores']['used']} cores"
    return (
        f"reach, {settings['box']} box, {result['backend']}{cores}: {metrics['reaches']} reaches "
        f"in {result['seconds']:g} s, seed {result['seeds']['run']}"
    )


def _draw_distance(axes: Axes, recording: Recording) -> None:
    axes.plot(recording.time_s, 100 * recording.distance_m, color=DISTANCE, lw=1.2)
    axes.axhline(100 * REACHED_M, color="0.5", ls="--", lw=0.8, label="reached below 4 cm")
    axes.set(ylabel="distance to target (cm)", xlabel="time (s)", ylim=(0, None))
    axes.legend(loc="upper right", frameon=False)


def _draw_axis(
    axes: Axes, recording: Recording, d: int, spikes: np.ndarray | None, name: str
) -> None:
    times, hand, target = recording.time_s, recording.hand[:, d], recording.target[:, d]
    if spikes is not None:
        step, neuron = np.nonzero(_by_tuning(spikes, target - hand))
        seconds = np.interp(step, np.linspace(0, len(spikes), len(times)), times)
        axes.scatter(seconds, neuron, s=0.6, color=SPIKES, marker="|", linewidths=0.5, alpha=0.6)
    axes.set_ylabel(f"M1 {name} neuron")
    position = axes.twinx()
    position.plot(times, hand, color=HAND, lw=1.6, label="hand")
    position.step(times, target, color=TARGET, ls=":", lw=1.6, label="target")
    position.set_ylabel(f"{name} (m)")
    if d == 0:
        position.legend(loc="upper right", ncols=2, framealpha=0.9)


def _by_tuning(spikes: np.ndarray, error: np.ndarray) -> np.ndarray:
    """The neurons in the order of how their spikes covary with the error along the axis."""
    per_sample = np.repeat(error, -(-len(spikes) // len(error)))[: len(spikes)]
    covariance = (per_sample - per_sample.mean()) @ spikes
    return spikes[:, np.argsort(covariance)]
