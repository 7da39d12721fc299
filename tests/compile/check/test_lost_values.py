"""The hints on values that read-outs and inputs lost in a run."""

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.compile.check.lost_values import (
    cut_off_by_design,
    hints_after,
    input_hints,
    readout_hints,
)
from spikeport.compile.pipeline import compile_network


def test_spikes_of_read_outs_are_counted_against_none():
    assert list(readout_hints(0, 100)) == []
    (hint,) = readout_hints(1234, 2000)
    assert str(hint) == (
        "read-outs: SP406 read-out saturation: 1,234 spikes in 2,000 steps, limit 0; cure: divide "
        "what is decoded by its full scale, or by more, and multiply on the host"
    )


def test_inputs_that_lose_spikes_in_a_hundredth_of_the_steps_are_not_named():
    (hint,) = input_hints({"a": 0.01, "b": 0.25})
    assert (hint.id, hint.object, hint.used) == ("SP408", "b", "spikes lost in 25 % of steps")


def driven(value, radius=1.0):
    """Return a network with one input."""
    with nengo.Network(seed=0) as network:
        at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
        ensemble = nengo.Ensemble(20, 1, radius=radius, neuron_type=at_rest, label="a")
        nengo.Connection(nengo.Node(value), ensemble)
        nengo.Connection(nengo.Node(-0.5), ensemble)
    return network


@pytest.mark.parametrize(("value", "expected"), [(0.9, []), (2.0, ["SP408"])])
def test_a_run_knows_the_values_that_no_compile_foresees(value, expected):
    with nengo.Network(seed=0) as network:
        a = nengo.Ensemble(20, 1, label="a")
        nengo.Connection(nengo.Node(lambda _t: value), a.neurons, transform=np.ones((20, 1)))
    compilation = compile_network(network)
    assert [hint.id for hint in compilation.report.hints] == ["SP421"]
    with cut_off_by_design(), Simulator(network, progress_bar=False) as sim:
        sim.run_steps(100)
    hints = hints_after(sim.activity, compilation.report.hints)
    assert [hint.id for hint in hints] == [hint["id"] for hint in sim.report()["hints"]] == expected


def test_a_simulator_warns_of_inputs_that_are_cut_off_as_it_closes_and_reports_them():
    """Beyond its filter, a value of 2 takes three spikes in two steps, of which one is lost."""
    sim = Simulator(driven(2.0))
    sim.run_steps(100)
    assert sim.activity.cut_off == {"nodes[0] -> a": 46, "nodes[1] -> a": 0}
    hints = [hint for hint in sim.report()["hints"] if hint["id"] == "SP408"]
    assert [(hint["object"], hint["used"]) for hint in hints] == [
        ("nodes[0] -> a", "spikes lost in 46 % of steps")
    ]
    with pytest.warns(UserWarning, match="SP408 input saturation: nodes.0. -> a .spikes lost"):
        sim.close()


def test_many_inputs_that_are_cut_off_are_one_warning():
    with nengo.Network(seed=0) as network:
        at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
        for _ in range(5):
            ensemble = nengo.Ensemble(20, 1, neuron_type=at_rest)
            nengo.Connection(nengo.Node(2.0), ensemble)
    sim = Simulator(network)
    sim.run_steps(50)
    with pytest.warns(UserWarning, match="SP408") as warned:
        sim.close()
    (warning,) = warned
    assert "of steps), 2 more; cure: widen the ensemble's radius" in str(warning.message)


@pytest.mark.filterwarnings("error::UserWarning")
def test_inputs_that_are_cut_off_by_design_are_in_the_report_alone():
    with cut_off_by_design(), Simulator(driven(2.0)) as sim:
        sim.run_steps(100)
    assert [hint["id"] for hint in sim.report()["hints"] if hint["id"] == "SP408"] == ["SP408"]


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize(("value", "radius"), [(1.0, 1.0), (2.0, 2.0), ([10.0], 10.0)])
def test_inputs_at_the_radius_lose_nothing(value, radius):
    with Simulator(driven(value, radius)) as sim:
        sim.run_steps(200)
    assert set(sim.activity.cut_off.values()) == {0}


def decoded(factor):
    """Return a network whose decoders have a gain, as a torque of a robot may have."""
    with nengo.Network(seed=0) as network:
        at_rest = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
        ensemble = nengo.Ensemble(100, 1, neuron_type=at_rest)
        nengo.Connection(nengo.Node(1.0), ensemble)
        motor = nengo.Node(lambda _t, _torque: None, size_in=1)
        nengo.Connection(ensemble, motor, transform=factor)
    return network


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["native", "board"])
def test_a_simulator_warns_of_lost_values_as_it_closes_and_reports_them(backend):
    sim = Simulator(decoded(30), backend=backend)
    sim.run_steps(100)
    n_spikes = sim.activity.readout_spikes
    assert n_spikes > 0
    assert [hint["used"] for hint in sim.report()["hints"] if hint["id"] == "SP406"] == [
        f"{n_spikes:,} spikes in 100 steps"
    ]
    warning = rf"SP406 read-out saturation: read-outs \({n_spikes:,} spikes in 100 steps\); cure"
    with pytest.warns(UserWarning, match=warning):
        sim.close()
    assert sim.closed


def leave(sim):
    with sim:
        pass


@pytest.mark.parametrize("end", [Simulator.close, Simulator.reset, leave])
def test_the_warning_names_the_line_that_closes_the_simulator(end):
    """Python shows a warning once a line: one in our code would be the only one of a script."""
    sim = Simulator(decoded(30))
    sim.run_steps(100)
    with pytest.warns(UserWarning, match="SP406") as warned:
        end(sim)
    sim.close()
    assert [one.filename for one in warned] == [__file__]


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize(("factor", "steps"), [(30, 0), (1, 100)])
def test_no_warning_comes_without_steps_or_without_lost_values(factor, steps):
    with Simulator(decoded(factor)) as sim:
        sim.run_steps(steps)
