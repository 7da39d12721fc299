"""Times of steps: the slowest core, and the barrier after it."""

import numpy as np
import pytest

from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate
from spikeport.hardware_models.step_time import (
    barrier,
    bus_times,
    core_events,
    core_times,
    known,
    step_times,
)
from tests.hardware_models.conftest import figure

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


def with_bus(data, **limits):
    """Return a chip with a bus of 50 ns a message, and other limits of cores and chips."""
    data["calibrations"][0]["times"]["message_on_bus"] = figure(50, "ns", 25, 100)
    for name, value in limits.items():
        data["limits"][name] = figure(value, "1")
    return ChipModel.model_validate(data)


def test_messages_to_all_cores_take_their_turns_on_a_bus(data, make_activity):
    chip, activity = with_bus(data), make_activity(messages_in=[[30, 10], [0, 1]])
    steps = step_times(activity, chip, chip.calibration("bench"))
    assert steps.value * 1e9 == pytest.approx([40 * 50 + 1000, 50 + 1000])
    assert steps.low * 1e9 == pytest.approx([40 * 25 + 500, 25 + 500])
    assert steps.high * 1e9 == pytest.approx([40 * 100 + 2000, 100 + 2000])


@pytest.mark.parametrize(("n_chips", "ns"), [(1, 2000), (2, 1500)])
def test_each_chip_has_a_bus_of_its_own(data, make_activity, n_chips, ns):
    chip = with_bus(data, cores=1, chips=n_chips)
    activity = make_activity(messages_in=[[30, 10]], n_steps=1)
    times = chip.calibration("bench").times
    assert bus_times(activity, chip, times, "value") * 1e9 == pytest.approx([ns])
    assert bus_times(activity, chip, chip.calibration("empty").times, "value") == [0]


def test_a_calibration_without_points_of_a_barrier_has_no_barrier(chip):
    assert barrier(1, chip.calibration("empty")) is None


def test_an_unknown_bound_is_none():
    assert known(float("nan")) is None
    assert known(2.0) == 2.0
