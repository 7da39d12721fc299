"""The energy of a run per unit of the robot's work."""

import nengo
import pytest

from spikeport import Simulator
from spikeport.experiments.costs import by_unit
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.energy import energy


@pytest.fixture(scope="module")
def activity():
    with nengo.Network(seed=1) as network:
        nengo.Probe(nengo.Ensemble(20, 1))
    with Simulator(network) as sim:
        sim.run_steps(50)
        return sim.activity


def test_the_energy_of_a_run_is_divided_by_the_amount_of_each_unit(activity):
    loihi = chips.get("loihi")
    found = by_unit(activity, loihi, {"second": 0.05, "reach": 4, "metre": 0.0}, 50)
    assert list(found) == ["second", "reach"]  # nobody walked
    for name, of_reach in found["reach"].items():
        spent = energy(activity, loihi, loihi.calibration(name))
        assert of_reach["dynamic"]["value"] == pytest.approx(spent.dynamic_run.value / 4)
        static = found["second"][name]["static"]
        assert [static[bound] for bound in ("low", "value", "high")] == [
            pytest.approx(watts) for watts in (0.029, 0.104, 0.110)
        ]


def test_steps_that_a_board_missed_cost_static_power_but_no_dynamic_energy(activity):
    loihi = chips.get("loihi")
    all_steps, held = (by_unit(activity, loihi, {"run": 1}, n)["run"] for n in (50, 60))
    for name, found in held.items():
        assert found["dynamic"] == all_steps[name]["dynamic"]
        static = all_steps[name]["static"]["value"]
        assert found["static"]["value"] == pytest.approx(static * 60 / 50)


def test_an_energy_without_a_public_figure_is_none(activity):
    found = by_unit(activity, chips.get("loihi2"), {"second": 0.05}, 50)
    assert found["second"]["intel-relative"]["dynamic"] is None
