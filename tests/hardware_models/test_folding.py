"""Folding: energy and time of a run whose early steps are kept as sums only."""

import dataclasses

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import PER_RUN, PER_STEP, Activity
from spikeport.hardware_models.energy import energy
from spikeport.hardware_models.step_time import fold
from spikeport.hardware_models.timing import timing

N_STEPS, N_CORES = 400, 3
STEPS = (*PER_STEP, "host_spikes")


@pytest.fixture
def whole(make_activity):
    rng = np.random.RandomState(0)
    counts = {name: rng.poisson(50, (N_STEPS, N_CORES)) for name in PER_STEP}
    messages = rng.poisson(9000, (N_CORES, N_CORES))
    return make_activity(
        N_STEPS,
        N_CORES,
        messages=messages,
        messages_host=messages[0],
        host_spikes=rng.poisson(20, N_STEPS),
        readout_spikes=2,
        **counts,
    )


def folded_at(activity: Activity, *ends: int, chip: chips.ChipModel | None) -> Activity:
    """Fold steps up to each of some ends, in turn; messages come evenly with the steps."""
    found = dataclasses.replace(activity, folded=None)
    for end in ends:
        begin = 0 if found.folded is None else found.folded.n_steps
        steps = {name: getattr(activity, name)[begin:end] for name in STEPS}
        sums = {name: getattr(activity, name) * end // N_STEPS for name in PER_RUN}
        found = dataclasses.replace(found, **steps, **sums)
        found = dataclasses.replace(found, folded=fold(found, chip))
    rest = {name: getattr(activity, name)[ends[-1] :] for name in STEPS}
    return dataclasses.replace(found, **rest, **{name: getattr(activity, name) for name in PER_RUN})


def close_to(report: dict) -> object:
    """Return the report to expect: numbers to 12 digits, everything else the same."""
    if isinstance(report, dict):
        return {key: close_to(value) for key, value in report.items()}
    if isinstance(report, list):
        return [close_to(value) for value in report]
    return pytest.approx(report, rel=1e-12, abs=0) if isinstance(report, float) else report


@pytest.mark.parametrize("ends", [(400,), (1,), (100, 200, 399), (100, 400)])
@pytest.mark.parametrize("name", ["davies2018", "nahuku-fit"])
def test_folded_steps_have_the_energy_and_the_time_of_steps_that_are_kept(whole, ends, name):
    loihi = chips.get("loihi")
    folded = folded_at(whole, *ends, chip=loihi)
    assert len(folded.spikes) == N_STEPS - ends[-1]
    assert folded.from_host == whole.from_host
    assert folded.totals() == whole.totals()
    calibration = loihi.calibration(name)
    for report in (energy, timing):
        wanted = report(whole, loihi, calibration).to_dict()
        assert report(folded, loihi, calibration).to_dict() == close_to(wanted)


@pytest.mark.parametrize("step", [0, 150, 399])
def test_the_longest_step_is_counted_from_the_first_of_the_run(whole, step):
    whole.synaptic_operations[step, 1] = 10**6
    loihi = chips.get("loihi")
    report = timing(folded_at(whole, 100, 300, chip=loihi), loihi, loihi.calibration("nahuku-fit"))
    assert (report.worst_step, report.limiting_core) == (step, "core 1")


def test_the_first_of_two_longest_steps_is_named(whole):
    whole.synaptic_operations[[50, 350], [2, 0]] = 10**6
    loihi = chips.get("loihi")
    report = timing(folded_at(whole, 200, chip=loihi), loihi, loihi.calibration("nahuku-fit"))
    assert (report.worst_step, report.limiting_core) == (50, "core 2")


def test_counts_are_exact_with_folded_steps(whole):
    folded = folded_at(whole, 100, 300, chip=None)
    assert folded.n_steps == N_STEPS
    assert folded.totals() == whole.totals()
    for name, count in whole.per_core().items():
        np.testing.assert_array_equal(folded.per_core()[name], count)


def test_kept_steps_have_the_messages_that_came_since(whole):
    kept = folded_at(whole, 100, chip=None).kept
    assert kept.n_steps == 300
    np.testing.assert_array_equal(kept.messages, whole.messages - whole.messages * 100 // N_STEPS)


def test_folded_steps_have_no_times_on_another_chip(whole):
    loihi, other = chips.get("loihi"), chips.get("loihi2")
    with pytest.raises(UsageError) as caught:
        energy(folded_at(whole, 100, chip=loihi), other, other.calibrations[0])
    assert str(caught.value) == (
        "only sums of the first 100 steps were kept, with times for chip 'loihi' but not for chip "
        "'loihi2'; run the network for chip 'loihi2', or fewer steps"
    )
    with pytest.raises(UsageError) as caught:
        energy(folded_at(whole, 100, chip=None), loihi, loihi.calibrations[0])
    assert str(caught.value) == (
        "only sums of the first 100 steps were kept, without times for chip 'loihi'; run the "
        "network for chip 'loihi', or fewer steps"
    )


@pytest.mark.parametrize("report", [energy, timing])
def test_folded_steps_have_no_times_of_another_calibration(whole, report):
    loihi, foreign = chips.get("loihi"), chips.get("loihi2").calibration("intel-relative")
    folded = folded_at(whole, 100, chip=loihi)
    with pytest.raises(UsageError) as caught:
        report(folded, loihi, foreign)
    assert str(caught.value) == (
        "only sums of the first 100 steps were kept, without times of calibration "
        "'intel-relative', which chip 'loihi' does not have; run fewer steps, or add the "
        "calibration to the chip's file"
    )
    known = loihi.calibration("davies2018")
    changed = known.model_copy(update={"times": foreign.times})
    assert changed.times != known.times
    with pytest.raises(UsageError, match="without times of calibration 'davies2018'"):
        report(folded, loihi, changed)
    assert report(whole, loihi, foreign).calibration == "intel-relative"


def test_only_the_first_part_of_a_run_may_have_folded_steps(whole):
    folded = folded_at(whole, 100, chip=None)
    assert Activity.concatenate([folded, whole]).totals()["spikes"] == 2 * whole.spikes.sum()
    message = "an activity that keeps only sums of its first steps must be the first part; run it"
    with pytest.raises(UsageError, match=message):
        Activity.concatenate([whole, folded])
