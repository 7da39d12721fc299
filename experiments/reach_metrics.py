"""The figures of a reach run."""

from typing import Any

import numpy as np

from spikeport.experiments.arm_loop import Sample
from spikeport.simulator import Simulator


def metrics(
    samples: list[Sample], reach_times_s: list[float], sim: Simulator, wall_s: float
) -> dict[str, Any]:
    """All metrics of a run.

    - ``reaches``: targets reached; ``seconds_per_reach_mean`` and ``_max``: time between reaches,
      the first from the start of the run and the last up to its end where that took longer;
    - ``distance_rms_m``: distance of hand and target, root mean square over the run;
    - ``torque_error_rms_nm``: controller against the exact law at the same state, per joint;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None off the chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    times = reach_times_s
    gaps = np.diff([0.0, *times])
    waited = np.diff([0.0, *times, sim.time])
    return {
        "reaches": len(times),
        "seconds_per_reach_mean": float(gaps.mean()) if len(times) else None,
        "seconds_per_reach_max": float(waited.max()),
        "distance_rms_m": float(np.sqrt(np.mean(distances(samples) ** 2))),
        "torque_error_rms_nm": torque_error_rms(samples),
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / wall_s,
    }


def distances(samples: list[Sample]) -> np.ndarray:
    """(n,) distance of hand and target at each physics step, in metres."""
    return np.array([np.linalg.norm(s.target - s.hand) for s in samples])


def torque_error_rms(samples: list[Sample]) -> list[float]:
    """Root mean square of the torque error of each joint, in N m."""
    error = np.array([s.torque - s.exact_torque for s in samples])
    return [float(e) for e in np.sqrt(np.mean(error**2, axis=0))]
