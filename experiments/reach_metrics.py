"""The figures of a reach run."""

from typing import Any

import numpy as np

from spikeport.experiments.arm_loop import Recording
from spikeport.simulator import Simulator


def metrics(
    recording: Recording,
    exact: np.ndarray,
    reach_times_s: list[float],
    sim: Simulator,
    wall_s: float,
) -> dict[str, Any]:
    """All metrics of a run, given the exact law's torques (n, 4) at its states.

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
        "distance_rms_m": float(_rms(recording.distance_m)),
        "torque_error_rms_nm": _rms(recording.torque - exact).tolist(),
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / wall_s,
    }


def _rms(values: np.ndarray) -> np.ndarray:
    """Root mean square over the first axis."""
    return np.sqrt(np.mean(values**2, axis=0))
