import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.walk.metrics import metrics, to_the_end
from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.port import LEAD_S
from spikeport.experiments.walk.recording import WalkRecording, WalkRun

SPEED_M_S, DT_S = 0.5, 0.005


def walked(seconds, fallen_at_s):
    """Return a run on a line by a robot that is 0.1 m beside its reference until it falls."""
    path = find_path("line", SPEED_M_S, seconds + LEAD_S)
    time_s = np.arange(0, fallen_at_s or seconds, DT_S)
    reference = np.array([path.at(t + LEAD_S) for t in time_s])
    state = np.zeros((len(time_s), 5))
    state[:, 1:3] = reference[:, :2] + [0, 0.1]
    recording = WalkRecording(
        time_s=time_s,
        observation=np.zeros((len(time_s), 69)),
        reference=reference,
        state=state,
        action=np.zeros((len(time_s), 19)),
        command=np.zeros((len(time_s), 2)),
        height_m=np.ones(len(time_s)),
        on_floor=np.ones((len(time_s), 2), dtype=bool),
        quaternion=np.zeros((len(time_s), 4)),
        turning_rad_s=np.zeros((len(time_s), 3)),
    )
    sim = SimpleNamespace(
        activity=SimpleNamespace(totals=lambda: {"spikes": 0}), time=time_s[-1] + DT_S
    )
    return WalkRun(path, seconds, recording, fallen_at_s, None, sim, wall_s=1.0)


def test_a_walk_without_a_fall_has_its_distances_from_reference_and_path():
    figures = metrics(walked(4.0, None))
    assert figures["falls"] == 0
    assert figures["path_mse_m2"] == pytest.approx(0.01)
    assert figures["cross_track_rms_m"] == pytest.approx(0.1, abs=1e-4)


def test_command_errors_compare_the_speed_along_the_heading_and_the_yaw_rate():
    run = walked(4.0, None)
    n = len(run.recording.time_s)
    state, ones = run.recording.state.copy(), np.ones(n)
    state[:, 0], state[:, 4] = np.pi / 2, 0.4  # to the north at 0.4 m/s
    recording = dataclasses.replace(
        run.recording,
        state=state,
        command=np.outer(ones, [0.5, 0.3]),
        quaternion=np.outer(ones, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]),
        turning_rad_s=np.outer(ones, [0.0, 0.0, 0.1]),
    )
    sim = SimpleNamespace(activity=SimpleNamespace(totals=lambda: {"spikes": 80}), time=4.0)
    figures = metrics(run._replace(recording=recording, sim=sim, wall_s=2.0))
    assert figures["speed_error_mean_m_s"] == pytest.approx(0.1)
    assert figures["yaw_rate_error_mean_rad_s"] == pytest.approx(0.2)
    assert (figures["spikes_per_second"], figures["real_time_factor"]) == (20, 2)


def test_the_path_error_grows_after_a_fall_while_the_reference_moves_on():
    figures = metrics(walked(4.0, 2.0))
    ahead_m = np.concatenate((np.zeros(400), SPEED_M_S * DT_S * np.arange(1, 401)))
    assert (figures["falls"], figures["fallen_at_s"]) == (1, 2.0)
    assert figures["path_mse_m2"] == pytest.approx(np.mean(ahead_m**2) + 0.01)
    assert figures["cross_track_rms_m"] == pytest.approx(0.1, abs=1e-4)


def test_a_run_that_is_no_multiple_of_the_physics_step_has_no_rows_of_a_fall():
    run = walked(4.0, None)._replace(seconds=4.003)
    assert len(to_the_end(run)[0]) == len(run.recording.position_m)


def test_an_earlier_fall_has_a_larger_path_error():
    errors = [metrics(walked(4.0, at))["path_mse_m2"] for at in (3.0, 2.0, 0.5)]
    assert errors == sorted(errors)
