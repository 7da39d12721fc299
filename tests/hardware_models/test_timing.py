import json

import pytest

from spikeport.errors import UsageError
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.estimate import Estimate
from spikeport.hardware_models.timing import timing
from tests.hardware_models.conftest import figure

SOURCE = "a paper [vendor]"


def ns(estimate):
    return [None if x is None else x * 1e9 for x in (estimate.value, estimate.low, estimate.high)]


def test_times_of_steps_equal_values_by_hand(chip, make_activity):
    activity = make_activity(
        updates_active=[[2, 0], [2, 1]],
        updates_inactive=[[0, 3], [1, 2]],
        synaptic_operations=[[4, 0], [0, 50]],
        spikes=[[1, 0], [0, 2]],
        messages_in=[[0, 0], [0, 3]],
    )
    # step 0: core 0:  2*10       + 4*1  + 1*100       = 124 ns, core 1: 3*5 = 15 ns
    # step 1: core 0:  2*10 + 1*5                      =  25 ns
    #         core 1:  1*10 + 2*5 + 50*1 + 2*100 + 3*7 = 291 ns
    # one tile: a barrier of 1000 ns; all times from 50 % to 200 %
    report = timing(activity, chip, chip.calibration("bench"))
    assert ns(report.worst) == pytest.approx([1291, 645.5, 2582])
    assert ns(report.mean) == pytest.approx([1207.5, 603.75, 2415])
    assert (report.worst_step, report.limiting_core) == (1, "core 1")
    assert ns(report.barrier) == pytest.approx([1000, 500, 2000])
    assert report.worst.source == SOURCE
    assert report.missing == ()


def test_the_longest_core_of_each_step_counts(chip, make_activity):
    activity = make_activity(synaptic_operations=[[30, 0], [0, 10]])
    assert timing(activity, chip, chip.calibration("bench")).mean.value == pytest.approx(1020e-9)


@pytest.mark.parametrize(
    ("dt_s", "fits", "fits_at_high"),
    [(1.0e-6, True, False), (0.9e-6, False, False), (2.0e-6, True, True)],
)
def test_steps_fit_if_they_take_no_longer_than_dt(chip, make_activity, dt_s, fits, fits_at_high):
    report = timing(make_activity(dt_s=dt_s), chip, chip.calibration("bench"))
    assert (report.fits, report.fits_at_high) == (fits, fits_at_high)


def test_barrier_is_that_of_the_tiles_in_use(chip, make_activity):
    assert timing(
        make_activity(n_cores=3), chip, chip.calibration("bench")
    ).mean.value == pytest.approx(1.5e-6)


def test_an_event_without_a_public_figure_is_named_and_leaves_no_upper_bound(chip, make_activity):
    activity = make_activity(learning_updates=[[0, 1], [0, 0]])
    report = timing(activity, chip, chip.calibration("bench"))
    assert report.missing == ("learning_update",)
    assert ns(report.worst) == [pytest.approx(1000), pytest.approx(500), None]
    assert report.fits_at_high is None


@pytest.fixture
def two_chips(data):
    """Return two chips of one core, with a time of 400 ns for a message between them."""
    bench = data["calibrations"][0]
    between = {**bench["times"]["spike"], "value": 400, "low": 200, "high": 800}
    bench["times"] = {**bench["times"], "message_between_chips": between}
    for name, value in (("cores", 1), ("chips", 2)):
        data["limits"][name] = {**data["limits"][name], "value": value}
    return ChipModel.model_validate(data)


def test_messages_between_chips_take_the_time_of_the_busiest_chip(two_chips, make_activity):
    activity = make_activity(
        spikes=[[5, 0], [1, 0]],
        messages=[[9, 4], [2, 9]],  # 4 leave the first chip in two steps: 800 ns a step
    )
    report = timing(activity, two_chips, two_chips.calibration("bench"))
    assert ns(report.between_chips) == pytest.approx([800, 400, 1600])
    # two tiles: a barrier of 1500 ns; step 0 takes 5 * 100 ns on core 0
    assert ns(report.worst) == pytest.approx([2300, 1150, 4600])
    assert report.missing == ()


def test_a_burst_of_messages_between_chips_makes_one_step_long(two_chips, make_activity):
    """With the mean of the run, a burst would seem to fit into every step."""
    activity = make_activity(
        n_steps=4,
        spikes=[[1, 0], [1, 0], [1, 0], [1, 0]],
        messages_in=[[0, 0], [0, 9], [0, 3], [0, 0]],  # those beyond 4 come from the host
        messages=[[0, 4], [0, 0]],
    )
    report = timing(activity, two_chips, two_chips.calibration("bench"))
    assert ns(report.between_chips) == pytest.approx([400, 200, 800])
    assert (report.worst_step, report.limiting_core) == (1, "a link between chips")
    # Three of four messages arrive in step 1, at most all four, and at least the one that is too
    # many for the other steps; two tiles: 1500 ns.
    assert ns(report.worst) == pytest.approx([1500 + 1200, 750 + 200, 3000 + 3200])


def test_messages_between_chips_without_a_figure_leave_no_upper_bound(data, make_activity):
    for name, value in (("cores", 1), ("chips", 2)):
        data["limits"][name] = {**data["limits"][name], "value": value}
    chip = ChipModel.model_validate(data)
    activity = make_activity(messages=[[0, 4], [2, 0]])
    report = timing(activity, chip, chip.calibration("bench"))
    assert report.missing == ("message_between_chips",)
    assert report.between_chips is None
    assert ns(report.worst) == [pytest.approx(1500), pytest.approx(750), None]


def test_a_calibration_without_figures_gives_a_time_without_an_upper_bound(chip, make_activity):
    report = timing(make_activity(spikes=[[1, 0], [0, 0]]), chip, chip.calibration("empty"))
    assert report.missing == ("spike", "barrier")
    assert report.barrier is None
    assert report.worst == Estimate(0.0, 0.0, None, "s", "")


def test_the_time_of_no_steps_is_refused(chip, make_activity):
    with pytest.raises(UsageError) as caught:
        timing(make_activity(n_steps=0), chip, chip.calibration("bench"))
    assert str(caught.value) == (
        "no time or energy in 0 steps of 2 cores; "
        "run at least one step of a network with ensembles on the chip"
    )


def test_to_dict_survives_json(chip, make_activity):
    plain = timing(make_activity(), chip, chip.calibration("bench")).to_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert plain["not_modelled"] == [
        "waiting for messages on the links between tiles",
        "sending of messages",
        "input and output of the host",
    ]
    assert plain["mean"]["unit"] == "s"


def test_the_source_of_a_bus_is_named_where_there_is_one(data, make_activity):
    on_bus = {**figure(50, "ns", 25, 100), "source": "the bus"}
    data["calibrations"][0]["times"]["message_on_bus"] = on_bus
    chip, activity = ChipModel.model_validate(data), make_activity(messages_in=[[30, 10], [0, 1]])
    assert "the bus" in timing(activity, chip, chip.calibration("bench")).mean.source
