"""What is drawn into pictures of the walking robot: its path, its reference and its trace."""

import numpy as np

from spikeport.experiments.pictures import Marks
from spikeport.experiments.walk.trial import WalkRun
from spikeport.robot.render import Mark

CAMERA = "track"
PATH_RGBA = (0.15, 0.15, 0.18, 1.0)
REFERENCE_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)
PATH_DT_S = 0.2
TRACE_STEPS = 20
MARKS = 400
"""The most marks of the path, and of the trace: of each, those of the last and next while."""


def walk_marks(run: WalkRun) -> Marks:
    """The path ahead and behind, the reference on it, and where the pelvis went."""
    recording = run.recording
    times = np.arange(0, recording.time_s[-1] + 2 * PATH_DT_S, PATH_DT_S)
    path = [_on_floor(run.path.at(t)[:2], 0.012, PATH_RGBA) for t in times]
    trace = [_on_floor(p, 0.012, TRACE_RGBA) for p in recording.position_m[::TRACE_STEPS]]

    def marks(end: int) -> list[Mark]:
        now = recording.time_s[end - 1] / PATH_DT_S
        near = slice(max(0, round(now) - MARKS // 2), round(now) + MARKS // 2)
        reference = _on_floor(recording.reference[end - 1, :2], 0.04, REFERENCE_RGBA)
        return [reference, *path[near], *trace[: end // TRACE_STEPS][-MARKS:]]

    return marks


def _on_floor(point: np.ndarray, radius_m: float, rgba: tuple[float, ...]) -> Mark:
    return Mark((point[0], point[1], radius_m), radius_m, rgba)
