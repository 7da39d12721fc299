"""The figures of a reach run."""

from typing import Any

import numpy as np

from spikeport.experiments.arm.metrics import arm_metrics, rms
from spikeport.experiments.arm.trial import ArmRun


def metrics(run: ArmRun, reach_times_s: list[float]) -> dict[str, Any]:
    """All metrics of a run, beside those of `arm_metrics`.

    - ``reaches``: targets reached; ``seconds_per_reach_mean`` and ``_max``: time between reaches,
      the first from the start of the run and the last up to its end where that took longer;
    - ``distance_rms_m``: distance of hand and target, root mean square over the run.
    """
    times = reach_times_s
    gaps = np.diff([0.0, *times])
    waited = np.diff([0.0, *times, run.sim.time])
    return {
        "reaches": len(times),
        "seconds_per_reach_mean": float(gaps.mean()) if len(times) else None,
        "seconds_per_reach_max": float(waited.max()),
        "distance_rms_m": float(rms(run.recording.distance_m)),
        **arm_metrics(run),
    }
