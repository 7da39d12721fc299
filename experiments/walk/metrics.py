"""The figures of a walking run."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from spikeport.experiments.curves import rms
from spikeport.experiments.walk.gait import clipped_shares
from spikeport.experiments.walk.port import LEAD_S
from spikeport.experiments.walk.recording import WalkRecording, WalkRun
from spikeport.robot.times import PHYSICS_DT_S

SMOOTHING_S = 0.2
"""Commands and motions are averaged over this time before they are compared."""


def metrics(run: WalkRun) -> dict[str, object]:
    """Return all metrics of a run.

    Distances are over the whole time that was asked for: a robot that fell lies where it fell, and
    the reference goes on. So an early fall does not count as a short path that was followed well.

    - ``falls``: 1 if the robot fell, which ends the run, else 0; ``fallen_at_s``: when;
    - ``cross_track_rms_m``, ``cross_track_max_m``: distance of the pelvis from the nearest point of
      the path, root mean square and largest;
    - ``path_mse_m2``: mean squared distance of the pelvis from the reference at that moment;
    - ``speed_error_mean_m_s``, ``yaw_rate_error_mean_rad_s``: mean size of command minus motion,
      along the heading and about the vertical, both smoothed over 0.2 s, up to a fall;
    - ``clipped_...``: share of the values of a part of the observation that were out of the range
      of its encoding, where there is one;
    - ``spikes_per_second``: of all neurons;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim, (position_m, reference_m) = run.sim, to_the_end(run)
    off_track_m = run.path.distances_m(position_m)
    from_reference_m = position_m - reference_m
    speed, yaw_rate = np.abs(command_errors(run.recording)).mean(axis=0)
    return {
        "falls": int(run.fallen_at_s is not None),
        "fallen_at_s": run.fallen_at_s,
        "cross_track_rms_m": float(rms(off_track_m)),
        "cross_track_max_m": float(off_track_m.max()),
        "path_mse_m2": float(np.mean(np.sum(from_reference_m**2, axis=1))),
        "speed_error_mean_m_s": float(speed),
        "yaw_rate_error_mean_rad_s": float(yaw_rate),
        **_clipped(run),
        "spikes_per_second": sim.activity.totals()["spikes"] / sim.time,
        "real_time_factor": sim.time / run.wall_s,
    }


def to_the_end(run: WalkRun) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 2) positions and references in m at all physics steps that were asked for."""
    position_m = run.recording.position_m
    reference_m = run.recording.reference[:, :2]
    n, n_asked = len(position_m), round(run.seconds / PHYSICS_DT_S)
    missing = 0 if run.fallen_at_s is None else max(n_asked - n, 0)
    later_s = LEAD_S + PHYSICS_DT_S * np.arange(n, n + missing)
    ahead_m = np.array([run.path.at(t)[:2] for t in later_s]).reshape(-1, 2)
    # The robot lies where it fell until the end of the time, while the reference goes on.
    lying_m = np.repeat(position_m[-1:], missing, axis=0)
    return np.concatenate((position_m, lying_m)), np.concatenate((reference_m, ahead_m))


def command_errors(recording: WalkRecording) -> np.ndarray:
    """Return (n, 2) command minus motion in m/s and rad/s, smoothed."""
    motion = np.stack((recording.speed_m_s, recording.yaw_rate_rad_s), axis=1)
    return smoothed(recording.command - motion)


def smoothed(values: np.ndarray) -> np.ndarray:
    """Return moving averages of values (n, ...), one for each physics step, over `SMOOTHING_S`."""
    size = round(SMOOTHING_S / PHYSICS_DT_S)
    return np.asarray(uniform_filter1d(values, size, axis=0, mode="nearest"))


def _clipped(run: WalkRun) -> dict[str, float]:
    if run.encoding is None:
        return {}
    shares = clipped_shares(run.recording.observation, run.encoding)
    return {f"clipped_{part.replace(' ', '_')}": share for part, share in shares.items()}
