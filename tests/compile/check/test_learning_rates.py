from typing import Any

import nengo
import pytest

from spikeport import Simulator, add_params, compile_network
from spikeport.compile.check.learning_rates import learning_rate_hints
from tests.helpers.small_networks import scope_of

PES = nengo.PES(1e-4)


def taught(rule: nengo.PES | None = PES, **options: Any) -> nengo.Network:
    """Return a network with a connection that learns."""
    with nengo.Network(seed=1) as network:
        a, end = nengo.Ensemble(20, 1, label="a", **options), nengo.Node(size_in=1, label="end")
        nengo.Connection(a, end, learning_rule_type=rule)
    return network


def on_learning(network: nengo.Network) -> list[str]:
    return [str(hint) for hint in learning_rate_hints(scope_of(network))]


def test_a_connection_that_learns_at_another_rate_gets_a_hint() -> None:
    assert on_learning(taught(radius=4.0)) == [
        "a -> end: SP420 learning rate: 0.0001 acts as 0.0004, 4 times as much; cure: if its "
        "learning_rate was not chosen for the chip, multiply it by 0.25, which is amplitude**2 / "
        "radius of its ensemble; float Nengo learns as fast without the factor"
    ]
    loud = nengo.LIF(amplitude=2.0)
    (found,) = on_learning(taught(neuron_type=loud))
    assert "0.0001 acts as 2.5e-05, 0.25 times as much; cure: if its" in found
    assert "multiply it by 4, " in found
    assert on_learning(taught()) == []
    assert on_learning(taught(neuron_type=loud, radius=4.0)) == []
    assert on_learning(taught(None, radius=4.0)) == []


def test_a_connection_that_learns_nothing_gets_a_hint() -> None:
    def of(rate: float, tau_s: float) -> list[str]:
        network = taught(nengo.PES(rate, pre_synapse=tau_s))
        with network:
            error = nengo.Node(0.5)
            nengo.Connection(error, network.connections[0].learning_rule)
        hints = compile_network(network).report.hints
        return [str(hint) for hint in hints if hint.id == "SP422"]

    assert of(1e-4, 0.005) == []
    expected = (
        "a -> end: SP422 learning that is rounded away: a spike adds 0 to its trace; cure: "
        "raise its learning_rate, or take a shorter pre_synapse"
    )
    assert of(1e-7, 0.005) == of(1e-4, 5.0) == [expected]


def test_small_errors_teach_nothing_and_multiplied_ones_do() -> None:
    def learned(error: float, rate: float, backend: str) -> float:
        network = taught(nengo.PES(rate))
        with network:
            a, end = network.ensembles[0], network.nodes[0]
            nengo.Connection(nengo.Node(0.5), a, synapse=None)
            rule = network.connections[0].learning_rule
            nengo.Connection(nengo.Node(-error), rule, synapse=None)
            values = nengo.Probe(end, synapse=0.02)
        with Simulator(network, backend=backend, pipeline="as_written") as sim:
            sim.run(0.3)
        return float(sim.data[values][-1, 0] - sim.data[values][100, 0])

    wanted = learned(0.004, 2e-3, "reference")
    assert abs(learned(0.004, 2e-3, "native")) < 0.2 * wanted
    assert learned(0.08, 1e-4, "native") == pytest.approx(wanted, rel=0.3)


def test_learning_on_the_host_gets_no_hint() -> None:
    network = taught(radius=4.0)
    add_params(network)
    network.config[network.ensembles[0]].on_chip = False
    assert on_learning(network) == []
