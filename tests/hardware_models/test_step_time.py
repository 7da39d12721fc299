"""Times of steps: the slowest core, and the barrier after it."""

import numpy as np
import pytest

from spikeport.hardware_models.estimate import Estimate
from spikeport.hardware_models.step_time import barrier, core_events, core_times, known, step_times

SOURCE = "a paper [vendor]"


@pytest.mark.parametrize(("tiles", "us"), [(1, 1.0), (2, 1.5), (3, 2.0), (4, 2.0), (32, 2.0)])
def test_barrier_is_interpolated_and_stays_at_the_ends(chip, tiles, us):
    expected = Estimate(us * 1e-6, us * 0.5e-6, us * 2e-6, "s", SOURCE)
    found = barrier(tiles, chip.calibration("bench"))
    assert [found.value, found.low, found.high] == pytest.approx(
        [expected.value, expected.low, expected.high]
    )
    assert (found.unit, found.source) == (expected.unit, expected.source)


def test_a_core_takes_its_events_one_after_the_other(chip, make_activity):
    activity = make_activity(
        updates_active=[[2, 0]],
        updates_inactive=[[0, 3]],
        synaptic_operations=[[4, 0]],
        spikes=[[1, 0]],
        messages_in=[[0, 2]],
        n_steps=1,
    )
    times = chip.calibration("bench").times
    found = core_times(activity, times, "value") * 1e9
    assert found == pytest.approx(np.array([[2 * 10 + 4 * 1 + 100, 3 * 5 + 2 * 7]]))
    assert core_times(activity, times, "high") * 1e9 == pytest.approx(2 * found)
    assert [event.name for event in core_events(activity)] == [
        "update_active",
        "update_inactive",
        "synaptic_operation",
        "spike",
        "message_in",
    ]


def test_an_event_without_a_public_figure_takes_no_time_and_leaves_no_upper_bound(
    chip, make_activity
):
    activity = make_activity(learning_updates=[[1, 0]], spikes=[[0, 1]], n_steps=1)
    times = chip.calibration("bench").times
    assert core_times(activity, times, "value") * 1e9 == pytest.approx(np.array([[0, 100]]))
    high = core_times(activity, times, "high")
    assert np.isnan(high[0, 0])


def test_a_step_is_its_longest_core_and_the_barrier(chip, make_activity):
    activity = make_activity(synaptic_operations=[[30, 0], [0, 10]])
    steps = step_times(activity, chip, chip.calibration("bench"))
    assert steps.value * 1e9 == pytest.approx([1030, 1010])
    assert steps.low * 1e9 == pytest.approx([515, 505])
    assert steps.high * 1e9 == pytest.approx([2060, 2020])


def test_a_calibration_without_points_of_a_barrier_has_no_barrier(chip):
    assert barrier(1, chip.calibration("empty")) is None


def test_an_unknown_bound_is_none():
    assert known(float("nan")) is None
    assert known(2.0) == 2.0
