"""Hints on read-outs that lose single spikes, against runs."""

import nengo
import pytest

from spikeport import Simulator
from spikeport.compile.pipeline import compile_network
from tests.helpers.cured import network_of
from tests.helpers.hint_cures import slow


@pytest.mark.parametrize(("factor", "n_hints"), [(1.0, 1), (0.7, 0)])
def test_a_neuron_whose_spikes_reach_the_threshold_of_its_read_out_gets_a_hint(
    factor: float, n_hints: int
) -> None:
    network = network_of(lambda: slow(factor=factor))
    with network:
        nengo.Connection(nengo.Node(0.9), network.ensembles[0])
    with Simulator(network) as sim:
        sim.run(0.2)
        found = [hint["object"] for hint in sim.report()["hints"] if hint["id"] == "SP426"]
        lost = [hint for hint in sim.report()["hints"] if hint["id"] == "SP406"]
    assert len(found) == len(lost) == n_hints
    assert found == ["ensembles[0] -> read-out"] * n_hints


def test_a_hint_names_the_largest_spike_and_a_factor_for_two_of_them() -> None:
    (hint,) = [
        hint for hint in compile_network(network_of(slow)).report.hints if hint.id == "SP426"
    ]
    times = float(hint.used.split()[2])
    assert 1 < times < 2
    assert "divide what is decoded by 4, and multiply on the host" in hint.cure


def test_weights_that_learn_get_no_hint_before_they_have_learned() -> None:
    with nengo.Network(seed=1) as network:
        a, out = nengo.Ensemble(2, 1), nengo.Node(size_in=1)
        learned = nengo.Connection(a, out, function=lambda x: 0, learning_rule_type=nengo.PES(1e-4))
        nengo.Connection(out, learned.learning_rule)
    assert all(hint.id != "SP426" for hint in compile_network(network).report.hints)
