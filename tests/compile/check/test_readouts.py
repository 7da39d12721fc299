"""The hint on read-outs that saturated in a run."""

import nengo
import pytest

from spikeport import Simulator
from spikeport.compile.check.readouts import readout_hints


def test_spikes_of_read_outs_are_counted_against_none():
    assert list(readout_hints(0, 100)) == []
    (hint,) = readout_hints(1234, 2000)
    assert str(hint) == (
        "read-outs: SP406 read-out saturation: 1,234 spikes in 2,000 steps, limit 0; cure: divide "
        "what is decoded by its full scale, and multiply on the host"
    )
    assert [one.used for one in readout_hints(1, 1)] == ["1 spike in 1 step"]


def decoded(factor):
    """Return a network whose decoders have a gain, as a torque of a robot may have."""
    with nengo.Network(seed=0) as network:
        at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
        ensemble = nengo.Ensemble(100, 1, neuron_type=at_rest)
        nengo.Connection(nengo.Node(1.0), ensemble)
        motor = nengo.Node(lambda _t, _torque: None, size_in=1)
        nengo.Connection(ensemble, motor, transform=factor)
    return network


@pytest.mark.parametrize("backend", ["native", "board"])
def test_a_simulator_warns_of_lost_values_as_it_closes_and_reports_them(backend):
    sim = Simulator(decoded(30), backend=backend)
    sim.run_steps(100)
    n_spikes = sim.activity.readout_spikes
    assert n_spikes > 0
    assert [hint["used"] for hint in sim.report()["hints"] if hint["id"] == "SP406"] == [
        f"{n_spikes:,} spikes in 100 steps"
    ]
    with pytest.warns(UserWarning, match=f"SP406 read-out saturation: {n_spikes:,} spikes in 100"):
        sim.close()
    assert sim.closed


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize(("factor", "steps"), [(30, 0), (1, 100)])
def test_no_warning_comes_without_steps_or_without_lost_values(factor, steps):
    with Simulator(decoded(factor)) as sim:
        sim.run_steps(steps)
