"""The figures that every run of the arm has."""

from typing import Any

import numpy as np

from spikeport.experiments.arm.trial import ArmRun


def rms(values: np.ndarray) -> np.ndarray:
    """Root mean square over the first axis."""
    return np.sqrt(np.mean(values**2, axis=0))


def arm_metrics(run: ArmRun) -> dict[str, Any]:
    """How well the controller did, whatever the task.

    - ``torque_error_rms_nm``: controller against the exact law at the same state, per joint;
    - ``joint_limit_steps``: physics steps with a joint at its lowest or highest angle;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None off the chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim = run.sim
    return {
        "torque_error_rms_nm": rms(run.recording.torque - run.exact).tolist(),
        "joint_limit_steps": int(run.at_limit.sum()),
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / run.wall_s,
    }
