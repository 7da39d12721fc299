"""The figures of a walking run, on runs that are made up."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.walk.metrics import metrics, smoothed, to_the_end
from tests.helpers.walk_runs import DT_S, SPEED_M_S, walked


def moving(speed_m_s, yaw_rate_rad_s):
    """Return a run of 4 s to the north, at 0.5 m/s and 0.3 rad/s if it did as commanded."""
    run = walked(4.0)
    n = len(run.recording.time_s)
    state, turning = run.recording.state.copy(), np.zeros((n, 3))
    state[:, 0], state[:, 4], turning[:, 2] = np.pi / 2, speed_m_s, yaw_rate_rad_s
    recording = dataclasses.replace(
        run.recording,
        state=state,
        command=np.tile([0.5, 0.3], (n, 1)),
        quaternion=np.tile([np.sqrt(0.5), 0, 0, np.sqrt(0.5)], (n, 1)),
        turning_rad_s=turning,
    )
    return run._replace(recording=recording)


def test_a_walk_without_a_fall_has_its_distances_from_reference_and_path():
    figures = metrics(walked(4.0))
    assert figures["falls"] == 0
    assert figures["path_mse_m2"] == pytest.approx(0.01)
    assert figures["cross_track_rms_m"] == pytest.approx(0.1, abs=1e-4)


def test_command_errors_compare_the_speed_along_the_heading_and_the_yaw_rate():
    figures = metrics(moving(0.4, 0.1))
    assert figures["speed_error_mean_m_s"] == pytest.approx(0.1)
    assert figures["yaw_rate_error_mean_rad_s"] == pytest.approx(0.2)


def test_speeds_that_are_too_low_and_too_high_do_not_cancel():
    late = np.arange(800) >= 400
    figures = metrics(moving(np.where(late, 0.6, 0.4), np.where(late, 0.5, 0.1)))
    # As they change sign, smoothed errors are half as large for 0.2 s: 3.9 s of the 4 s count.
    assert figures["speed_error_mean_m_s"] == pytest.approx(0.1 * 3.9 / 4)
    assert figures["yaw_rate_error_mean_rad_s"] == pytest.approx(0.2 * 3.9 / 4)


def test_a_sway_with_a_period_of_a_fifth_of_a_second_is_smoothed_away():
    sway = np.sin(2 * np.pi * DT_S * np.arange(400) / 0.2)
    # At either end, the first and the last value stand for those beyond.
    np.testing.assert_allclose(smoothed(sway)[20:-20], 0, atol=1e-12)


def test_spikes_are_per_simulated_and_real_time_per_wall_clock_second():
    sim = SimpleNamespace(activity=SimpleNamespace(totals=lambda: {"spikes": 80}), time=4.0)
    figures = metrics(walked(4.0)._replace(sim=sim, wall_s=2.0))
    assert (figures["spikes_per_second"], figures["real_time_factor"]) == (20, 2)


def test_the_path_error_grows_after_a_fall_while_the_reference_moves_on():
    figures = metrics(walked(4.0, 2.0))
    ahead_m = np.concatenate((np.zeros(400), SPEED_M_S * DT_S * np.arange(1, 401)))
    assert (figures["falls"], figures["fallen_at_s"]) == (1, 2.0)
    assert figures["path_mse_m2"] == pytest.approx(np.mean(ahead_m**2) + 0.01)
    assert figures["cross_track_rms_m"] == pytest.approx(0.1, abs=1e-4)


def test_a_run_that_is_no_multiple_of_the_physics_step_has_no_rows_of_a_fall():
    run = walked(4.0)._replace(seconds=4.003)
    assert len(to_the_end(run)[0]) == len(run.recording.position_m)


def test_an_earlier_fall_has_a_larger_path_error():
    late, earlier, at_once = (metrics(walked(4.0, at))["path_mse_m2"] for at in (3.0, 2.0, 0.5))
    assert late < earlier < at_once
