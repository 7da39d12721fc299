"""Runs of the arm that are made up."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from spikeport.experiments.arm.recording import ArmRecording, ArmRun


def finished(
    distances: Sequence[float],
    torques: Sequence[float] = (0.0,),
    at_limit: Sequence[bool] = (False,),
    wall_s: float = 1.0,
) -> ArmRun:
    """Make up a run of 4 s whose exact torques are zero."""
    n = len(distances)
    target, torque = np.outer(distances, [1, 0, 0]), np.outer(torques, np.ones(4))
    zero = np.zeros((n, 4))
    recording = ArmRecording(0.005 * np.arange(n), zero, zero, np.zeros((n, 3)), target, torque)
    sim = SimpleNamespace(time=4.0, image=None)
    return ArmRun(recording, None, zero, np.array(at_limit), {}, sim, wall_s)
