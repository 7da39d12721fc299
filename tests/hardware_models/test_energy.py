import json

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import energy


def numbers(estimate, scale):
    bounds = (estimate.value, estimate.low, estimate.high)
    return [None if x is None else x * scale for x in bounds]


@pytest.fixture
def activity(make_activity):
    return make_activity(
        n_cores=8,
        synaptic_operations=np.full((2, 8), 3),
        updates_active=np.full((2, 8), 2),
        updates_inactive=np.full((2, 8), 1),
        spikes=[[4, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 1]],
        messages=np.diag([4], k=7) + np.diag([1] + [0] * 7),
        messages_host=[0, 0, 6, 0, 0, 0, 0, 0],
    )


def test_dynamic_energy_equals_values_by_hand(chip, activity):
    report = energy(activity, chip, chip.calibration("bench"))
    expected = {
        "synaptic_operation": (48, 48 * 1),
        "update_active": (32, 32 * 10),
        "update_inactive": (16, 16 * 5),
        "spike": (5, 5 * 100),
        "message": (4 + 1 + 6, 11 * 1000),
        "hop_east_west": (4, 4 * 2),  # core 0 at (0, 0) -> core 7 at (1, 1)
        "hop_north_south": (4, 4 * 3),
    }
    terms = {term.event: term for term in report.terms}
    for event, (count, pj) in expected.items():
        term = terms[event]
        assert term.count == count
        assert numbers(term.energy, 1e12) == pytest.approx([pj, pj / 2, pj * 2])
    # 48 + 320 + 80 + 500 + 11000 + 8 + 12 = 11968 pJ in two steps of 1 ms
    assert numbers(report.dynamic_run, 1e12) == pytest.approx([11968, 5984, 23936])
    assert numbers(report.dynamic.energy_step, 1e12) == pytest.approx([5984, 2992, 11968])
    assert numbers(report.dynamic.power, 1e6) == pytest.approx([5.984, 2.992, 11.968])
    assert report.dynamic.power.unit == "W"
    assert report.dynamic_run.source == "a paper [vendor]"


def test_the_energies_of_the_cores_add_up_to_the_total(chip, activity):
    report = energy(activity, chip, chip.calibration("bench"))
    whole = sum(core.energy_step.value for core in report.cores)
    assert whole == pytest.approx(report.dynamic.energy_step.value)
    # core 7: 6 synaptic operations, 4 active and 2 inactive updates, a spike, in two steps
    assert numbers(report.cores[7].energy_step, 1e12) == pytest.approx([78, 39, 156])


def test_events_without_any_public_figure_have_no_energy(chip, activity):
    report = energy(activity, chip, chip.calibration("empty"))
    assert report.dynamic_run is None
    assert report.dynamic is None
    assert {core.energy_step for core in report.cores} == {None}
    assert report.system.power.format() == "1 W [>= 1]"


def test_a_figure_of_learning_is_not_missing_if_there_are_no_updates(chip, activity):
    report = energy(activity, chip, chip.calibration("bench"))
    assert (report.terms[-1].event, report.terms[-1].count) == ("learning_update", 0)
    assert report.terms[-1].energy is None
    assert report.missing == ()


def test_static_and_system_power_equal_values_by_hand(chip, activity):
    report = energy(activity, chip, chip.calibration("bench"))
    # steps take less than dt: 100 mW and 1 W over 1 ms
    assert report.period_s == pytest.approx(1e-3)
    assert numbers(report.static.power, 1e3) == pytest.approx([100, 90, 110])
    assert numbers(report.static.energy_step, 1e6) == pytest.approx([100, 90, 110])
    assert numbers(report.system.power, 1) == pytest.approx([1.000005984, 1.000002992, 1.500011968])
    assert report.system.energy_step.value == pytest.approx(1.000005984e-3)


def test_a_step_longer_than_dt_draws_static_power_for_longer(chip, make_activity):
    # barrier 1000 ns + 4000 synaptic operations of 1 ns: 5000 ns in step 0, 1000 ns in step 1
    activity = make_activity(dt_s=2e-6, synaptic_operations=[[4000, 0], [0, 0]])
    report = energy(activity, chip, chip.calibration("bench"))
    assert report.period_s == pytest.approx((5e-6 + 2e-6) / 2)
    assert report.static.energy_step.value == pytest.approx(0.1 * 3.5e-6)
    assert report.dynamic.power.value == pytest.approx(4000e-12 / 2 / 3.5e-6)


def test_an_event_without_a_public_figure_is_named_and_leaves_no_upper_bound(chip, make_activity):
    activity = make_activity(spikes=[[1, 0], [0, 0]], learning_updates=[[0, 7], [0, 0]])
    report = energy(activity, chip, chip.calibration("bench"))
    assert report.missing == ("learning_update",)
    assert report.terms[-1].count == 7
    assert report.terms[-1].energy is None
    assert numbers(report.dynamic_run, 1e12) == [pytest.approx(100), pytest.approx(50), None]
    assert report.dynamic_run.format() == "100 pJ [>= 50]"


def test_powers_without_a_public_figure_are_named_and_absent(data, make_activity):
    chip = ChipModel.model_validate(data | {"power": {}})
    report = energy(make_activity(), chip, chip.calibration("bench"))
    assert report.static is None
    assert report.system is None
    assert report.missing == ("static_chip_w", "board_idle_w")


def test_a_board_with_more_chips_than_the_measured_one_has_no_system_power(data, make_activity):
    data["limits"]["chips"] = {**data["limits"]["chips"], "value": 11}  # 11 of 100 mW; a board 1 W
    chip = ChipModel.model_validate(data)
    report = energy(make_activity(), chip, chip.calibration("bench"))
    assert report.static.power.value == pytest.approx(1.1)
    assert (report.system, report.missing) == (None, ("board_idle_w",))


def test_hops_are_missing_without_a_public_mesh(data, make_activity):
    chip = ChipModel.model_validate(data | {"topology": None})
    bench = chip.calibration("bench")
    assert energy(make_activity(messages=[[3, 0], [0, 1]]), chip, bench).missing == ()
    expected = make_activity(messages=np.diag([0.1, 0.2]))  # whose sum is not that of its diagonal
    assert energy(expected, chip, bench).missing == ()
    assert energy(make_activity(messages=[[3, 1], [0, 1]]), chip, bench).missing == ("hops",)


def test_energies_of_consecutive_runs_add_up(make_activity):
    loihi = chips.get("loihi")
    for seed in range(20):
        rng = np.random.RandomState(seed)
        parts = [random_activity(make_activity, rng, n_steps) for n_steps in (1, 3, 5)]
        for name in ("davies2018", "nahuku-fit"):
            whole = energy(Activity.concatenate(parts), loihi, loihi.calibration(name))
            runs = [energy(part, loihi, loihi.calibration(name)) for part in parts]
            total = runs[0].dynamic_run + runs[1].dynamic_run + runs[2].dynamic_run
            assert whole.dynamic_run.value == pytest.approx(total.value)
            assert whole.dynamic_run.low == pytest.approx(total.low)
            assert whole.dynamic_run.high == pytest.approx(total.high)
            static = sum(run.static.energy_step.value * run.n_steps for run in runs)
            assert whole.static.energy_step.value * whole.n_steps == pytest.approx(static)


def random_activity(make_activity, rng, n_steps):
    shape = (n_steps, 9)
    return make_activity(
        n_steps=n_steps,
        n_cores=9,
        spikes=rng.randint(1, 100, shape),
        synaptic_operations=rng.randint(1, 10_000, shape),
        updates_active=rng.randint(1, 1000, shape),
        updates_inactive=rng.randint(1, 1000, shape),
        messages=rng.randint(0, 100, (9, 9)),
        messages_host=rng.randint(0, 100, 9),
    )


def test_davies_has_no_figure_for_messages(make_activity):
    activity = make_activity(spikes=[[10, 0], [0, 0]], messages=[[0, 10], [0, 0]])
    loihi = chips.get("loihi")
    report = energy(activity, loihi, loihi.calibration("davies2018"))
    assert report.missing == ("message",)
    assert report.dynamic_run.format() == "17 pJ [no interval]"
    assert report.dynamic_run.source == "Davies 2018 [transcribed]"
    assert report.static.power.format() == "104 mW [29, 110]"


def test_the_energy_of_no_steps_is_refused(chip, make_activity):
    with pytest.raises(UsageError, match=r"^no time or energy in 0 steps of 2 cores; "):
        energy(make_activity(n_steps=0), chip, chip.calibration("bench"))


def test_to_dict_survives_json(chip, activity):
    plain = energy(activity, chip, chip.calibration("bench")).to_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert plain["terms"][0]["energy"]["unit"] == "J"
    assert plain["static"]["power"] == {
        "value": 0.1,
        "low": 0.09,
        "high": 0.11,
        "unit": "W",
        "source": "a paper [vendor]",
    }
    assert plain["not_modelled"] == [
        "hops of messages from the host, whose route is not public",
        "work of the host's and the chip's processors",
    ]
