"""Metrics of the arm, on made-up runs."""

import dataclasses

import numpy as np
import pytest

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.arm.metrics import drawing, lag, reach_metrics, shape_error
from spikeport.experiments.arm.recording import ArmRecording
from tests.helpers.arm_runs import finished


def recorded(time_s, hand, target):
    zero = np.zeros((len(time_s), 4))
    return ArmRecording(time_s, zero, zero, hand, target, zero)


def test_only_the_time_of_the_drawing_counts():
    times = np.arange(0, 4, 0.5)
    position = np.zeros((8, 3))
    assert drawing(recorded(times, position, position)).time_s.tolist() == [2.0, 2.5, 3.0, 3.5]
    assert DrawTask.begin_s == 2.0


def test_a_drawing_has_its_first_sample_though_sums_of_steps_are_rounded():
    times = np.cumsum([0.0, *[0.005] * 800])
    position = np.zeros((801, 3))
    assert times[400] < DrawTask.begin_s
    drawn = drawing(recorded(times, position, position))
    assert len(drawn.time_s) == 401
    assert drawn.time_s[0] == times[400]


def test_the_shape_error_is_the_distance_to_the_nearest_point():
    stroke = np.stack([np.linspace(0, 1, 1001), np.zeros(1001), np.zeros(1001)], axis=1)
    trace = np.array([[0.5, 0.03, 0.04], [-0.3, 0.0, 0.4], [0.2, 0.0, 0.0]])
    assert shape_error(stroke, trace) == pytest.approx([0.05, 0.5, 0.0])


def test_the_lag_is_the_time_by_which_the_hand_follows():
    times = np.arange(2, 7, 0.005)

    def pen(t):
        return np.stack([np.cos(2 * t), np.sin(3 * t), t], axis=1)

    assert lag(recorded(times, pen(times - 0.12), pen(times))) == pytest.approx(0.12)
    assert lag(recorded(times, pen(times), pen(times))) == 0.0
    in_real_time = times.copy()
    in_real_time[1::2] -= 0.005  # every other state came twice
    hand, target = pen(times - 0.12), pen(times)
    assert lag(recorded(in_real_time, hand, target)) == pytest.approx(0.12, abs=0.001)


def test_a_run_with_reaches_has_its_metrics():
    run = finished([0.3, 0.4], [1.0, -1.0], [False, True], wall_s=2.0)
    figures = reach_metrics(run, [0.5, 1.5])
    assert figures["reaches"] == 2
    assert figures["seconds_per_reach_mean"] == 0.75
    assert figures["seconds_per_reach_max"] == 2.5
    assert figures["distance_rms_m"] == pytest.approx(0.125**0.5)
    assert figures["torque_error_rms_nm"] == [1.0] * 4
    assert figures["joint_limit_steps"] == 1
    assert figures["readout_spikes"] is None
    assert figures["real_time_factor"] == 2.0


def test_the_torque_error_is_the_difference_to_the_exact_torque_at_the_same_state():
    run = finished([0.3, 0.4], [1.0, 3.0])
    run = run._replace(exact=np.outer([1.0, 2.0], np.ones(4)))
    assert reach_metrics(run, [])["torque_error_rms_nm"] == pytest.approx([0.5**0.5] * 4)


def test_the_last_reach_in_real_time_may_be_later_than_the_end_of_simulated_time():
    run = finished([0.3, 0.4], [1.0, -1.0])
    late = dataclasses.replace(run.recording, time_s=np.array([0.0, 4.5]))
    assert reach_metrics(run._replace(recording=late), [1.0, 4.25])["seconds_per_reach_max"] == 3.25
    assert reach_metrics(run._replace(recording=late), [1.0])["seconds_per_reach_max"] == 3.5


def test_a_run_without_reaches_has_no_mean_time_per_reach():
    figures = reach_metrics(finished([0.3]), [])
    assert figures["reaches"] == 0
    assert figures["seconds_per_reach_mean"] is None
    assert figures["seconds_per_reach_max"] == 4.0
