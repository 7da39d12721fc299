"""The paper's Fig. 5c: spikes of the policy above, the pose of the pelvis below.

The red line is the time at which ensembles are silenced; the figure begins shortly before it.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.constants import DT_S
from spikeport.counted import percent
from spikeport.experiments.run_folder import Result
from spikeport.experiments.walk.recording import WalkRecording, WalkRun

BEFORE_S = 5.0
ONSET, SPIKES = "#c62828", "#44474d"
GRAVITY = {"pitch": (0, 1.0), "roll": (1, -1.0)}
"""Components of gravity's direction in the pelvis frame that are the sines of its tilts, forwards
and to the right, and their signs."""


def silence_figure(run: WalkRun, spikes: np.ndarray, result: Result) -> Figure:
    """Draw the figure of spikes (n_steps, n); ``result`` is the content of ``result.json``."""
    figure = Figure(figsize=(10, 8), layout="constrained")
    above, height, tilt = figure.subplots(3, 1, sharex=True, height_ratios=[2.4, 1, 1])
    settings, end = result["settings"], run.recording.time_s[-1]
    _draw_spikes(above, spikes)
    _draw_pose(height, tilt, run.recording)
    for axes in (above, height, tilt):
        axes.axvline(settings["silence_at"], color=ONSET, lw=2)
    tilt.set(xlabel="time (s)", xlim=(max(0, min(settings["silence_at"], end) - BEFORE_S), end))
    fell = "no fall" if run.fallen_at_s is None else f"fell at {run.fallen_at_s:.2f} s"
    figure.suptitle(
        f"walk, {settings['path']}, {result['backend']}: {percent(settings['silence'])} of the "
        f"policy's ensembles silenced at {settings['silence_at']:g} s; {fell}"
    )
    return figure


def _draw_spikes(axes: Axes, spikes: np.ndarray) -> None:
    step, neuron = np.nonzero(spikes)
    axes.plot((step + 1) * DT_S, neuron, "|", color=SPIKES, ms=2, mew=0.6)
    axes.set(ylabel="neuron", ylim=(-1, spikes.shape[1]))


def _draw_pose(height: Axes, tilt: Axes, recording: WalkRecording) -> None:
    height.plot(recording.time_s, 100 * recording.height_m)
    height.set_ylabel("pelvis height (cm)")
    for name, (component, sign) in GRAVITY.items():
        sine = sign * recording.down[:, component]
        tilt.plot(recording.time_s, np.rad2deg(np.arcsin(sine)), label=name)
    tilt.set_ylabel("tilt (deg)")
    tilt.legend(loc="upper left", frameon=False, ncols=2)
