"""Parts of the figures of the arm."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from spikeport.experiments.arm.trial import ArmRun

HAND, TARGET, ERROR, DISTANCE = "#2a9d4a", "#e8871e", "#5b6fd6", "#1f9aa0"
SPIKES, LIMIT = "#44474d", "#c62828"


def title(result: dict[str, Any], task: str, achieved: str) -> str:
    """What was done, on what, and how well."""
    cores = "" if result["resources"] is None else f", {result['resources']['cores']['used']} cores"
    return (
        f"{task}, {result['backend']}{cores}: {achieved} "
        f"in {result['seconds']:g} s, seed {result['seeds']['run']}"
    )


def show_picture(axes: Axes, picture: np.ndarray) -> None:
    """The robot."""
    axes.imshow(picture)
    axes.set_axis_off()


def mark_limits(axes: Axes, run: ArmRun) -> None:
    """Ticks along the time axis where a joint was at its lowest or highest angle."""
    times = run.recording.time_s[run.at_limit]
    if len(times):
        label = f"joint at its limit ({len(times)} steps)"
        axes.plot(times, np.zeros(len(times)), "|", color=LIMIT, ms=12, label=label)


def draw_axis(axes: Axes, run: ArmRun, d: int, name: str) -> None:
    """Spikes of M1 of one axis with hand, error and target over them (paper, Fig. 4b)."""
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
    position.set_ylabel(f"{name} from {middle:.2f} m (m)")
    if d == 0:
        position.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)


def _draw_spikes(axes: Axes, times: np.ndarray, spikes: np.ndarray, error: np.ndarray) -> None:
    step, neuron = np.nonzero(_by_tuning(spikes, error))
    seconds = np.interp(step, np.linspace(0, len(spikes), len(times)), times)
    axes.scatter(seconds, neuron, s=0.6, color=SPIKES, marker="|", linewidths=0.5, alpha=0.6)


def _by_tuning(spikes: np.ndarray, error: np.ndarray) -> np.ndarray:
    """The neurons in the order of how their spikes covary with the error along the axis."""
    per_sample = np.repeat(error, -(-len(spikes) // len(error)))[: len(spikes)]
    covariance = (per_sample - per_sample.mean()) @ spikes
    return spikes[:, np.argsort(covariance)]
