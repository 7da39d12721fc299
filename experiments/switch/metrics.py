"""The figures of a switching run."""

from typing import Any

import numpy as np

from spikeport.experiments.arm.metrics import rms
from spikeport.experiments.switch.phases import phase_metrics, shape_errors
from spikeport.experiments.switch.trial import SwitchRun


def metrics(run: SwitchRun) -> dict[str, Any]:
    """All metrics of a run.

    - ``falls``: 1 if the robot fell, which ends the run, else 0; ``fallen_at_s``: when;
    - ``phases``: see `experiments.switch.phases.phase_metrics`;
    - ``phases_done``: how many of these were a success;
    - ``recognised_as``: the digit a classifier reads in the first drawing, None where there is
      none, or no classifier;
    - ``shape_error_rms_m``: of all drawings together, None where there is none;
    - ``spikes_by_nucleus``: of the action selection;
    - ``spikes_per_second``: of all neurons;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None off the chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim, phases = run.sim, phase_metrics(run)
    return {
        "falls": int(run.fallen_at_s is not None),
        "fallen_at_s": run.fallen_at_s,
        "phases": phases,
        "phases_done": sum(phase["success"] for phase in phases),
        "recognised_as": next((p["recognised_as"] for p in phases if "recognised_as" in p), None),
        "shape_error_rms_m": _shape_error(run),
        "spikes_by_nucleus": {name: int(spikes.sum()) for name, spikes in run.spikes.items()},
        "spikes_per_second": sim.activity.totals()["spikes"] / sim.time,
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / run.wall_s,
    }


def _shape_error(run: SwitchRun) -> float | None:
    apart = np.concatenate([shape_errors(run, goal) for goal in run.goals])
    return float(rms(apart)) if len(apart) else None
