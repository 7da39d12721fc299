"""The metrics of runs of the arm: of every run, of a reach run, and of a drawing."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from spikeport.experiments.arm.draw_task import pen_is_down
from spikeport.experiments.arm.recording import ArmRecording, ArmRun
from spikeport.experiments.curves import rms

LONGEST_LAG_S = 1.0


def arm_metrics(run: ArmRun) -> dict[str, object]:
    """Return the metrics of the controller, which are the same for every task.

    - ``torque_error_rms_nm``: controller against the exact law at the same state, per joint;
    - ``joint_limit_steps``: physics steps with a joint at its lowest or highest angle;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None without a chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim = run.sim
    return {
        "torque_error_rms_nm": rms(run.recording.torque - run.exact).tolist(),
        "joint_limit_steps": int(run.at_limit.sum()),
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / run.wall_s,
    }


def reach_metrics(run: ArmRun, reach_times_s: Sequence[float]) -> dict[str, object]:
    """Return the metrics of a reach run, and those of `arm_metrics`.

    - ``reaches``: targets reached; ``seconds_per_reach_mean`` and ``_max``: time between reaches,
      the first from the start of the run; the maximum includes the time from the last to the end;
    - ``distance_rms_m``: distance of hand and target, root mean square over the run.
    """
    gaps = np.diff([0.0, *reach_times_s])
    # A hand that got stuck shows here, not in the mean over its reaches.
    # In real time, the clock of a robot may be ahead of its controller's.
    end_s = max(run.sim.time, run.recording.time_s[-1])
    waited = np.diff([0.0, *reach_times_s, end_s])
    return {
        "reaches": len(reach_times_s),
        "seconds_per_reach_mean": float(gaps.mean()) if len(reach_times_s) else None,
        "seconds_per_reach_max": float(waited.max()),
        "distance_rms_m": float(rms(run.recording.distance_m)),
        **arm_metrics(run),
    }


def drawing(recording: ArmRecording) -> ArmRecording:
    """Return the part of a recording in which the pen is down, without the approach."""
    return recording.where(pen_is_down(recording.time_s))


def shape_error(stroke: np.ndarray, trace: np.ndarray) -> np.ndarray:
    """Return (n,) distances in m of points (n, 3) from the nearest point of a stroke (m, 3)."""
    return np.asarray(cKDTree(stroke).query(trace)[0])


def lag(drawn: ArmRecording) -> float:
    """Return the time in s by which the hand lags: argmin_l mean_t |x(t + l) - target(t)|^2."""
    # The mean, as in real time the steps of a robot's own clock differ, and some take none of it.
    dt_s = (drawn.time_s[-1] - drawn.time_s[0]) / (len(drawn.time_s) - 1)
    # At least half of a drawing is compared.
    steps = range(min(round(LONGEST_LAG_S / dt_s), len(drawn.time_s) // 2))
    errors_m = [
        rms(np.linalg.norm(drawn.hand[k:] - drawn.target[: len(drawn.target) - k], axis=1))
        for k in steps
    ]
    return float(np.argmin(errors_m) * dt_s)


def draw_metrics(run: ArmRun, stroke: np.ndarray, recognised_as: int | None) -> dict[str, object]:
    """Return the metrics of a drawing, without its approach, and those of `arm_metrics`.

    - ``shape_error_rms_m`` and ``_max_m``: distance of the trace's points to the stroke;
    - ``tracking_error_rms_m``: distance of hand and moving target;
    - ``lag_s``: time by which the hand lags behind the target;
    - ``recognised_as``: the digit a classifier reads, None where there is no classifier.
    """
    drawn = drawing(run.recording)
    errors_m = shape_error(stroke, drawn.hand)
    return {
        "shape_error_rms_m": float(rms(errors_m)),
        "shape_error_max_m": float(errors_m.max()),
        "tracking_error_rms_m": float(rms(drawn.distance_m)),
        "lag_s": lag(drawn),
        "recognised_as": recognised_as,
        **arm_metrics(run),
    }
