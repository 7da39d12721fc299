"""Energy by unit of what a robot did."""

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


def test_the_energy_of_all_steps_is_shared_by_what_was_done(activity):
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


def test_a_chip_that_did_not_step_draws_its_static_power_all_the_same(activity):
    loihi = chips.get("loihi")
    all_steps, held = (by_unit(activity, loihi, {"run": 1}, n)["run"] for n in (50, 60))
    for name, found in held.items():
        assert found["dynamic"] == all_steps[name]["dynamic"]
        static = all_steps[name]["static"]["value"]
        assert found["static"]["value"] == pytest.approx(static * 60 / 50)


def test_what_is_not_public_has_no_energy(activity):
    found = by_unit(activity, chips.get("loihi2"), {"second": 0.05}, 50)
    assert found["second"]["intel-relative"]["dynamic"] is None
