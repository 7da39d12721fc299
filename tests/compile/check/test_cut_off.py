"""Hints on values that the host sends into neurons, which are cut off, against runs."""

from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.pipeline import compile_network

UNKNOWN = "not known before a run"
PRESENTED = nengo.processes.PresentInput([[0.5, -1.0], [1.0, 0.2]], 0.1)


def hints(network: nengo.Network, pipeline: str = "as_written") -> list[str]:
    found = compile_network(network, pipeline=pipeline).report.hints
    return [str(hint) for hint in found if hint.id == "SP421"]


def driven(output: object, scale: float = 1.0, **options: Any) -> nengo.Network:
    """Return a network whose node sends its values, divided by a scale, into neurons."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, label="a", radius=4.0, gain=np.ones(20), bias=np.full(20, 0.5))
        node = nengo.Node(output, label="node")
        transform = np.full((20, node.size_out), scale)
        nengo.Connection(node, a.neurons, **{"transform": transform, "synapse": None, **options})
        nengo.Probe(a.neurons)
    return network


def test_a_constant_beyond_1_gets_a_hint_whatever_the_radius() -> None:
    assert hints(driven([-3.0])) == [
        "node -> a: SP421 values for neurons: up to 3, limit 1; cure: if values go beyond the "
        "limit, divide them by their full scale, and multiply the transform by it"
    ]
    assert hints(driven([-1.0], scale=3.0)) == []


def rate(network: nengo.Network, **options: Any) -> float:
    with spikeport.Simulator(network, progress_bar=False, **options) as sim:
        sim.run(0.3)
    return float(sim.data[network.all_probes[0]].mean())


def test_the_cure_gives_nengos_rates() -> None:
    wanted = rate(driven([3.0]), backend="reference")
    cut, cured = (rate(driven([v], s), pipeline="as_written") for v, s in ((3.0, 1.0), (1.0, 3.0)))
    assert cut < 0.5 * wanted
    assert cured == pytest.approx(wanted, rel=0.1)


@pytest.mark.parametrize(
    ("output", "used"),
    [
        (lambda t: 0.5, [UNKNOWN]),
        (nengo.processes.WhiteSignal(1, 5), [UNKNOWN]),
        (np.sin, []),
        (PRESENTED, []),
        (nengo.processes.PresentInput([[2.0], [-5.0]], 0.1), ["up to 5"]),
        (nengo.processes.Piecewise({0.1: [0.5, -1.0], 0.2: [1.0, 0.2]}), []),
        (nengo.processes.Piecewise({0.1: 0.5, 0.2: -3.0}, "linear"), ["up to 3"]),
        (nengo.processes.Piecewise({0.1: 0.5, 0.2: -0.5, 0.3: 0.5}, "quadratic"), [UNKNOWN]),
        (nengo.processes.Piecewise({0.1: 0.5, 0.2: np.sin}), [UNKNOWN]),
        ([0.9, 1.0], []),
    ],
)
def test_values_that_are_not_known_get_a_hint(output: object, used: list[str]) -> None:
    found = [one.split(": ")[2].split(",")[0] for one in hints(driven(output))]
    assert found == used


def test_functions_and_slices_are_those_of_the_connection() -> None:
    assert len(hints(driven([0.5], function=lambda x: x))) == 1
    assert hints(driven([5.0], function=np.tanh)) == []
    with driven([0.5]) as network:
        node = nengo.Node([0.1, 7.0])
        nengo.Connection(node[0], network.all_ensembles[0].neurons[:1])
    assert hints(network) == []
    assert hints(driven([9.0, 0.5], transform=np.tile([0.0, 1.0], (20, 1)))) == []


def test_passthrough_nodes_pass_on_and_add_up() -> None:
    def summed(weights: tuple[float, float]) -> nengo.Network:
        with driven([0.5]) as network:
            node = nengo.Node(size_in=1, label="sum")
            for weight, value in zip(weights, (2.0, -1.0), strict=True):
                nengo.Connection(nengo.Node([value]), node, transform=weight, synapse=None)
            nengo.Connection(nengo.Node(lambda t: 9.0), node, transform=0.0, synapse=None)
            neurons = network.all_ensembles[0].neurons
            nengo.Connection(node, neurons, transform=np.ones((20, 1)), synapse=None)
        return network

    assert hints(summed((0.2, 0.6))) == []
    (found,) = hints(summed((0.2, 0.7)))
    assert found.startswith("sum -> a: SP421 values for neurons: up to 1.1, limit 1; ")


@pytest.mark.parametrize(
    ("pipeline", "beside", "cut"),
    [("as_written", False, False), ("as_written", True, True), ("compact", False, True)],
)
def test_nodes_that_are_multiplied_out_no_longer_scale_values(
    pipeline: str, beside: bool, cut: bool
) -> None:
    large = nengo.processes.PresentInput([[5.0]], 0.1)
    with driven([0.5]) as network:
        neurons, node = network.all_ensembles[0].neurons, nengo.Node(size_in=1)
        nengo.Connection(nengo.Node(large, label="large"), node, transform=0.1, synapse=None)
        if beside:  # the node is between ensembles on the chip
            nengo.Connection(nengo.Ensemble(20, 1), node)
        nengo.Connection(node, neurons, transform=np.ones((20, 1)), synapse=None)
    found = hints(network, pipeline)
    assert len(found) == cut
    assert all(one.startswith("large -> ") and "up to 5, limit 1" in one for one in found)


def test_only_values_that_lead_to_neurons_get_a_hint() -> None:
    with driven([0.5]) as network:
        through = nengo.Node(size_in=2)
        nengo.Connection(nengo.Node([5.0], label="high"), through[0], synapse=None)
        nengo.Connection(nengo.Ensemble(20, 1), through[1])
        nengo.Connection(through[0], nengo.Ensemble(20, 1, radius=10))
        after, neurons = nengo.Node(size_in=1), network.all_ensembles[0].neurons
        nengo.Connection(through[1], after, synapse=None)
        nengo.Connection(after, neurons, transform=np.ones((20, 1)))
    assert hints(network) == []
    with network:
        nengo.Connection(through[0], neurons, transform=np.ones((20, 1)))
    (found,) = hints(network)
    assert found.startswith("high -> ")


def test_an_entry_that_a_slice_has_twice_is_followed() -> None:
    with driven([0.5]) as network:
        first, second = nengo.Node(size_in=1), nengo.Node(size_in=2)
        nengo.Connection(nengo.Node([5.0], label="high"), first, synapse=None)
        nengo.Connection(first[[0, 0]], second, synapse=None)
        # Between ensembles on the chip, so that both nodes are replaced.
        nengo.Connection(nengo.Ensemble(20, 1), first)
        neurons = network.all_ensembles[0].neurons
        nengo.Connection(second[0], neurons, transform=np.ones((20, 1)))
    (found,) = hints(network)
    assert found.startswith("high -> ")


def test_a_chain_of_nodes_may_be_longer_than_pythons_stack() -> None:
    with driven([0.5]) as network:
        node = nengo.Node([3.0])
        for _ in range(400):
            before, node = node, nengo.Node(size_in=1, label="last")
            nengo.Connection(before, node, synapse=None)
        neurons = network.all_ensembles[0].neurons
        nengo.Connection(node, neurons, transform=np.ones((20, 1)))
    (found,) = hints(network)
    assert "#400 -> a: SP421 values for neurons: up to 3, limit 1" in found


def test_a_loop_of_passthrough_nodes_is_not_known() -> None:
    with driven([0.5]) as network:
        node = nengo.Node(size_in=1)
        nengo.Connection(node, node, synapse=0.1)
        neurons = network.all_ensembles[0].neurons
        nengo.Connection(node, neurons, transform=np.ones((20, 1)))
    assert len(hints(network)) == 1


def test_ensembles_on_the_host_keep_to_their_radius_unless_they_are_direct() -> None:
    def decoded(radius: float, kind: nengo.neurons.NeuronType) -> nengo.Network:
        with driven([0.5]) as network:
            spikeport.add_params(network)
            host = nengo.Ensemble(20, 1, radius=radius, neuron_type=kind)
            network.config[host].on_chip = False
            neurons = network.all_ensembles[0].neurons
            nengo.Connection(host, neurons, transform=np.ones((20, 1)))
            if not isinstance(kind, nengo.Direct):
                nengo.Connection(host.neurons, neurons, transform=np.eye(20))
        return network

    assert hints(decoded(1.0, nengo.LIF())) == []
    assert len(hints(decoded(2.0, nengo.LIF()))) == 1
    assert len(hints(decoded(1.0, nengo.Direct()))) == 1


def test_values_at_evaluation_points_are_known() -> None:
    def decoded(full_scale: float) -> nengo.Network:
        with driven([0.5]) as network:
            spikeport.add_params(network)
            host = nengo.Ensemble(20, 1, radius=2.0)
            network.config[host].on_chip = False
            points = np.linspace(-2, 2, 50)[:, np.newaxis]
            values = {"eval_points": points, "function": full_scale * np.cos(points)}
            neurons = network.all_ensembles[0].neurons
            nengo.Connection(host, neurons, transform=np.ones((20, 1)), **values)
        return network

    assert hints(decoded(0.9)) == []
    assert len(hints(decoded(1.5))) == 1


def test_a_pass_that_sends_larger_values_has_a_larger_limit() -> None:
    assert hints(driven([2.5]), "sparse_inputs{weight=3},as_written") == []
    (found,) = hints(driven([3.5]), "sparse_inputs{weight=3},as_written")
    assert "up to 3.5, limit 3" in found


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_values_for_dimensions_get_no_hint(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        large = [nengo.Ensemble(30, 1, radius=4.0) for _ in range(2)]
        for ensemble in large:
            nengo.Connection(nengo.Node([3.0]), ensemble)
            nengo.Connection(nengo.Node(lambda t: 3.0), ensemble)
    assert hints(network, pipeline) == []


def test_constants_that_become_biases_get_no_hint() -> None:
    assert hints(driven([3.0]), "constant_inputs,as_written") == []
