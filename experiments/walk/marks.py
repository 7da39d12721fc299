"""Marks on the floor in pictures of a walking robot: its path, its reference and its trace."""

import numpy as np

from spikeport.experiments.pictures import Marks
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.recording import WalkRun
from spikeport.robot.render import Mark
from spikeport.robot.terrain import Floor

PATH_RGBA = (0.15, 0.15, 0.18, 1.0)
REFERENCE_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)
PATH_M, REFERENCE_M = 0.012, 0.04
"""Radii of marks."""
PATH_DT_S = 0.2
TRACE_STEPS = 20
MARKS = 400
"""The most marks of the path, and of the trace: the nearest in time of each."""


def walk_marks(run: WalkRun) -> Marks:
    """Mark the path ahead and behind, the reference on it, and the trace of the pelvis."""
    recording, floor = run.recording, run.floor
    path = path_marks(run.path, recording.time_s[-1] + 2 * PATH_DT_S, floor)
    trace = [on_floor(p, PATH_M, TRACE_RGBA, floor) for p in recording.position_m[::TRACE_STEPS]]

    def marks(end: int) -> list[Mark]:
        now = recording.time_s[end - 1] / PATH_DT_S
        # A picture's scene has room for a limited number of shapes.
        near = slice(max(0, round(now) - MARKS // 2), round(now) + MARKS // 2)
        place = recording.reference[end - 1, :2]
        reference = on_floor(place, REFERENCE_M, REFERENCE_RGBA, floor)
        return [reference, *path[near], *trace[: end // TRACE_STEPS][-MARKS:]]

    return marks


def path_marks(path: WalkPath, seconds: float, floor: Floor) -> list[Mark]:
    """Return the marks of a path up to a time."""
    places = [path.at(t)[:2] for t in np.arange(0, seconds, PATH_DT_S)]
    return [on_floor(place, PATH_M, PATH_RGBA, floor) for place in places]


def on_floor(
    place: np.ndarray, radius_m: float, rgba: tuple[float, float, float, float], floor: Floor
) -> Mark:
    """Return a mark that lies on the floor at a place (2,)."""
    height_m = float(floor.height_m(place[:1], place[1:])[0])
    return Mark((place[0], place[1], height_m + radius_m), radius_m, rgba)
