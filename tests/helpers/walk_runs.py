"""Runs of a walking robot that are made up."""

from types import SimpleNamespace

import numpy as np

from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.port import LEAD_S
from spikeport.experiments.walk.recording import WalkRecording, WalkRun

SPEED_M_S, DT_S = 0.5, 0.005


def walked(seconds: float, fallen_at_s: float | None = None) -> WalkRun:
    """Make up a run on a line by a robot that is 0.1 m beside its reference until it falls."""
    path = find_path("line", SPEED_M_S, seconds + LEAD_S)
    time_s = np.arange(0, fallen_at_s or seconds, DT_S)
    reference = np.array([path.at(t + LEAD_S) for t in time_s])
    state = np.zeros((len(time_s), 5))
    state[:, 1:3] = reference[:, :2] + [0, 0.1]
    recording = WalkRecording(
        time_s=time_s,
        observation=np.zeros((len(time_s), 69)),
        reference=reference,
        state=state,
        action=np.zeros((len(time_s), 19)),
        command=np.zeros((len(time_s), 2)),
        height_m=np.ones(len(time_s)),
        on_floor=np.ones((len(time_s), 2), dtype=bool),
        quaternion=np.zeros((len(time_s), 4)),
        turning_rad_s=np.zeros((len(time_s), 3)),
    )
    sim = SimpleNamespace(
        activity=SimpleNamespace(totals=lambda: {"spikes": 0}), time=time_s[-1] + DT_S
    )
    return WalkRun(path, seconds, recording, fallen_at_s, None, sim, wall_s=1.0)
