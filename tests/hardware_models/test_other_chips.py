"""The figures of loihi2.toml and spinnaker2.toml, and reports where figures are absent."""

import numpy as np
import pytest

from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.energy import energy
from spikeport.hardware_models.timing import timing

LOIHI2, SPINNAKER2 = chips.get("loihi2"), chips.get("spinnaker2")


def test_times_of_loihi_2_are_fractions_of_those_of_loihi_1():
    davies = chips.get("loihi").calibration("davies2018").times
    relative = LOIHI2.calibration("intel-relative").times
    factors = {"synaptic_operation": 5, "update_active": 2, "update_inactive": 2, "spike": 10}
    for event, factor in factors.items():
        assert getattr(relative, event).value == pytest.approx(
            getattr(davies, event).value / factor
        )


def test_figures_of_loihi_2_that_are_not_public_are_absent():
    assert LOIHI2.limits.compartments.count == 8192
    assert LOIHI2.limits.in_axons is None
    (calibration,) = LOIHI2.calibrations
    assert {figure for _, figure in calibration.energies} == {None}


def test_loihi_2_has_no_energy_and_says_what_is_missing(make_activity):
    activity = make_activity(synaptic_operations=[[1, 2], [3, 4]], spikes=[[1, 0], [0, 0]])
    report = energy(activity, LOIHI2, LOIHI2.calibration("intel-relative"))
    assert (report.dynamic, report.system) == (None, None)
    assert report.static.power.value == 0.28
    assert report.missing == ("synaptic_operation", "spike", "board_idle_w")


def test_spinnaker_2_has_energies_and_no_times(make_activity):
    calibration = SPINNAKER2.calibration("hoeppner2019")
    assert not calibration.has_times
    activity = make_activity(synaptic_operations=np.full((2, 2), 5), updates_active=[[1, 1]] * 2)
    report = energy(activity, SPINNAKER2, calibration)
    assert report.dynamic.energy_step.value == pytest.approx(10 * 0.45e-9 + 2 * 2.19e-9)
    assert (report.static, report.system) == (None, None)


def test_a_mesh_that_is_not_public_has_no_hops(make_activity):
    assert SPINNAKER2.topology is None
    activity = make_activity(n_cores=200, messages=np.ones((200, 200), dtype=int))
    terms = {t.event: t for t in energy(activity, SPINNAKER2, SPINNAKER2.calibrations[0]).terms}
    assert terms["hop_east_west"].count == terms["hop_north_south"].count == 0


def test_a_chip_without_a_public_mesh_has_the_barrier_of_one_tile(make_activity, chip):
    activity = make_activity(n_cores=8)
    unknown = chip.model_copy(update={"topology": None})
    barriers = [timing(activity, one, one.calibration("bench")).barrier for one in (unknown, chip)]
    assert [barrier.value for barrier in barriers] == pytest.approx([1e-6, 2e-6])


def test_a_step_of_loihi_2_is_its_longest_core_and_the_barrier(make_activity):
    activity = make_activity(synaptic_operations=[[1000, 10], [0, 0]])
    taken = timing(activity, LOIHI2, LOIHI2.calibration("intel-relative"))
    assert taken.worst.value == pytest.approx(1000 * 0.7e-9 + 200e-9)


@pytest.mark.parametrize("chip", [LOIHI2, SPINNAKER2], ids=lambda chip: chip.name)
def test_both_chips_have_a_caveat_on_their_integers(chip):
    assert "the integers are those of nengo-loihi for Loihi 1" in chip.caveat
