"""The figures of a drawing; they count the drawing alone, not the approach."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.arm.loop import Recording
from spikeport.experiments.arm.metrics import arm_metrics, rms
from spikeport.experiments.arm.trial import ArmRun

LONGEST_LAG_S = 1.0


def drawing(recording: Recording) -> Recording:
    """The part of a recording in which the pen is down."""
    down = recording.time_s >= DrawTask.begin_s
    return Recording(*(column[down] for column in recording))


def shape_error(stroke: np.ndarray, trace: np.ndarray) -> np.ndarray:
    """(n,) distance in m of points (n, 3) to the nearest point of a stroke (m, 3)."""
    return cKDTree(stroke).query(trace)[0]


def lag(drawn: Recording) -> float:
    """Time in s by which the hand follows the target: argmin_l sum_t |x(t + l) - target(t)|^2."""
    dt_s = drawn.time_s[1] - drawn.time_s[0]
    steps = range(min(round(LONGEST_LAG_S / dt_s), len(drawn.time_s) // 2))
    apart = [
        rms(np.linalg.norm(drawn.hand[k:] - drawn.target[: len(drawn.target) - k], axis=1))
        for k in steps
    ]
    return float(np.argmin(apart) * dt_s)


def metrics(run: ArmRun, stroke: np.ndarray, recognised_as: int | None) -> dict[str, Any]:
    """All metrics of a run, beside those of `arm_metrics`.

    - ``shape_error_rms_m`` and ``_max_m``: distance of the trace's points to the stroke;
    - ``tracking_error_rms_m``: distance of hand and moving target;
    - ``lag_s``: time by which the hand follows the target;
    - ``recognised_as``: the digit a classifier reads, None where there is no classifier.
    """
    drawn = drawing(run.recording)
    apart = shape_error(stroke, drawn.hand)
    return {
        "shape_error_rms_m": float(rms(apart)),
        "shape_error_max_m": float(apart.max()),
        "tracking_error_rms_m": float(rms(drawn.distance_m)),
        "lag_s": lag(drawn),
        "recognised_as": recognised_as,
        **arm_metrics(run),
    }
