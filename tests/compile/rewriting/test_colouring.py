"""Ensembles that are wired alike, and ensembles that can be regrouped."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest
from nengo.solvers import Lstsq

import spikeport
from spikeport.compile.ground.quantisation import relative_rms
from spikeport.compile.rewriting import colouring
from spikeport.compile.rewriting.colouring import alike, neuron_key, regroupable
from spikeport.compile.rewriting.passthrough import foldable
from tests.helpers.small_networks import FAST, SLOW, scope_of

Edge = tuple[str, str, nengo.synapses.Synapse | None]


def network_of(
    ensembles: Sequence[str], edges: Sequence[Edge], nodes: Sequence[str] = (), **types: Any
) -> nengo.Network:
    """Return one-dimensional ensembles and passthrough nodes by label, and their connections."""
    with nengo.Network(seed=1) as network:
        objects: dict[str, Any] = {
            label: nengo.Ensemble(5, 1, label=label, neuron_type=types.get(label, nengo.LIF()))
            for label in ensembles
        }
        objects |= {label: nengo.Node(size_in=1, label=label) for label in nodes}
        for pre, post, synapse in edges:
            nengo.Connection(objects[pre], objects[post], synapse=synapse)
    return network


def groups(network: nengo.Network) -> list[str]:
    """Return the groups of ensembles wired alike, each as its labels."""
    found = alike(scope_of(network), network.all_ensembles)
    return ["".join(sorted(e.label or "" for e in group)) for group in found]


def test_ensembles_wired_alike_are_found() -> None:
    edges = [("a", "c", FAST), ("b", "d", FAST)]
    assert groups(network_of("abcd", edges)) == ["ab", "cd"]


def test_ensembles_with_different_neuron_types_are_not_alike() -> None:
    slow = nengo.LIF(tau_rc=0.05)
    assert groups(network_of("abc", [], b=slow)) == ["ac", "b"]
    assert groups(network_of("abc", [], b=slow, c=slow)) == ["a", "bc"]
    assert groups(network_of("ab", [], b=nengo.SpikingRectifiedLinear())) == ["a", "b"]


@pytest.mark.parametrize(("radius", "found"), [(0.1, ["ab"]), (15.0, ["ab"]), (1e-3, ["a", "b"])])
def test_ensembles_whose_radii_differ_by_orders_of_magnitude_are_not_alike(
    radius: float, found: list[str]
) -> None:
    network = network_of("ab", [])
    network.ensembles[1].radius = radius
    assert groups(network) == found


def test_ensembles_with_different_initial_voltages_are_alike() -> None:
    zero = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
    assert groups(network_of("ab", [], b=zero)) == ["ab"]


def test_ensembles_with_different_output_filters_are_not_alike() -> None:
    edges = [("a", "c", FAST), ("b", "c", SLOW)]
    assert groups(network_of("abc", edges)) == ["a", "b", "c"]
    assert groups(network_of("abc", [("a", "c", FAST), ("b", "c", FAST)])) == ["ab", "c"]


def test_ensembles_with_different_input_filters_are_not_alike() -> None:
    edges = [("c", "a", FAST), ("c", "b", SLOW)]
    assert groups(network_of("abc", edges)) == ["a", "b", "c"]


def test_a_source_and_its_target_are_not_alike_but_a_mutual_pair_is() -> None:
    assert groups(network_of("ab", [("a", "b", FAST)])) == ["a", "b"]
    assert groups(network_of("ab", [("a", "b", FAST), ("b", "a", FAST)])) == ["ab"]


def test_connections_that_filter_elsewhere_are_not_alike() -> None:
    edges = [("a", "c", SLOW), ("b", "d", SLOW)]
    direct, full = network_of("abcd", edges), network_of("abcd", edges)
    spikeport.add_params(direct)
    direct.config[direct.connections[0]].decode_path = "direct"
    full.connections[0].solver = nengo.solvers.LstsqL2(weights=True)
    assert groups(direct) == groups(full) == ["a", "b", "c", "d"]


def test_connections_of_neurons_and_of_values_are_not_alike() -> None:
    network = network_of("abc", [("a", "c", FAST), ("b", "c", FAST)])
    assert groups(network) == ["ab", "c"]
    a, b, c = network.ensembles
    with network:
        nengo.Connection(a.neurons, c, transform=np.ones((1, 5)), synapse=FAST)
        nengo.Connection(b, c.neurons, transform=np.ones((5, 1)), synapse=FAST)
    assert groups(network) == ["a", "b", "c"]


@pytest.mark.parametrize("nodes", ["", "xy"])
def test_ensembles_with_different_neighbours_of_neighbours_are_not_alike(nodes: str) -> None:
    """Only the last ensembles of two chains, with or without passthrough nodes, differ in input."""
    first = [("a", nodes[0], None), (nodes[0], "b", FAST)] if nodes else [("a", "b", FAST)]
    second = [("d", nodes[1], None), (nodes[1], "e", FAST)] if nodes else [("d", "e", FAST)]
    chains = [*first, ("b", "c", FAST), *second, ("e", "f", FAST)]
    assert groups(network_of("abcdef", chains, nodes)) == ["ad", "be", "cf"]
    other = [*chains, ("c", "c", SLOW)]
    assert groups(network_of("abcdef", other, nodes)) == ["a", "b", "c", "d", "e", "f"]


def test_ensembles_with_different_numbers_of_neighbours_are_alike() -> None:
    edges = [("c", "a", FAST), ("c", "b", FAST), ("d", "b", FAST), ("d", "a", FAST)]
    assert groups(network_of("abcd", edges)) == ["ab", "cd"]
    assert groups(network_of("abcd", edges[:-1])) == ["ab", "cd"]


def test_inputs_from_different_nodes_that_stay_are_alike() -> None:
    network = network_of("ab", [])
    with network:
        for end in network.ensembles:
            nengo.Connection(nengo.Node([0.5]), end)
    assert groups(network) == ["ab"]


def test_inputs_from_a_passthrough_node_and_a_node_that_stays_are_not_alike() -> None:
    network = network_of("ab", [("x", "a", FAST)], "x")
    with network:
        nengo.Connection(nengo.Node([0.5]), network.ensembles[1], synapse=FAST)
    assert groups(network) == ["a", "b"]


def test_only_the_listed_ensembles_are_grouped() -> None:
    network = network_of("abc", [])
    a, _, c = network.ensembles
    assert alike(scope_of(network), [a, c]) == [[a, c]]


def test_targets_that_stay_and_targets_that_do_not_are_not_alike() -> None:
    network = network_of("abcd", [("a", "c", FAST), ("b", "d", FAST)])
    a, b, c, _ = network.ensembles
    assert alike(scope_of(network), [a, b, c]) == [[a], [b], [c]]


TREE = [("a", "c", FAST), ("b", "c", FAST), ("d", "f", FAST), ("e", "f", FAST), ("f", "f", SLOW)]


@pytest.mark.slow
def test_groups_do_not_depend_on_the_order_of_definition() -> None:
    expected = {"ab", "c", "de", "f"}
    for order in itertools.islice(itertools.permutations("abcdef"), 0, None, 37):
        assert set(groups(network_of("".join(order), TREE))) == expected
    for edges in itertools.permutations(TREE):
        assert set(groups(network_of("fbdace", edges))) == expected


def test_only_neighbours_of_recoloured_objects_are_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A chain gets its colours from both of its ends, two ensembles a round."""
    few, many = (n_looks(n, monkeypatch) for n in (20, 80))
    assert many < 4**1.2 * few


def n_looks(n: int, monkeypatch: pytest.MonkeyPatch) -> int:
    network = network_of([], [])
    with network:
        ends = itertools.pairwise(nengo.Ensemble(2, 1) for _ in range(n))
        for pre, post in ends:
            nengo.Connection(pre, post)
    looks = []
    look = colouring._Refinement._neighbours
    with monkeypatch.context() as patch:
        patch.setattr(
            colouring._Refinement, "_neighbours", lambda me, obj: looks.append(obj) or look(me, obj)
        )
        assert len(groups(network)) == n
    return len(looks)


def test_groups_are_in_the_order_of_their_first_ensembles() -> None:
    assert groups(network_of("fbdace", TREE)) == ["f", "ab", "de", "c"]


def test_the_key_of_neurons_has_all_parameters_but_the_initial_state() -> None:
    with nengo.Network():
        kinds = [
            nengo.LIF(),
            nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])}),
            nengo.LIF(amplitude=0.5),
            nengo.RegularSpiking(nengo.LIFRate()),
            nengo.RegularSpiking(nengo.RectifiedLinear()),
        ]
        keys = [neuron_key(nengo.Ensemble(3, 1, neuron_type=kind)) for kind in kinds]
    assert keys[0] == keys[1]
    assert len(set(keys)) == 4


def pair() -> nengo.Network:
    """Return two ensembles wired through a passthrough node and a third; all can be regrouped."""
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        first, second = (nengo.Ensemble(5, 1, label=label) for label in ("first", "second"))
        relay = nengo.Node(size_in=1, label="relay")
        nengo.Connection(first, relay, synapse=None)
        nengo.Connection(relay, second, synapse=FAST)
        nengo.Ensemble(5, 1, label="other")
    return network


def regroupable_labels(network: nengo.Network) -> list[str]:
    scope = scope_of(network)
    return [e.label for e in regroupable(scope, foldable(scope))]


def test_only_ensembles_on_the_chip_can_be_regrouped() -> None:
    network = pair()
    network.config[network.ensembles[2]].on_chip = False
    assert regroupable_labels(network) == ["first", "second"]


def test_ensembles_with_ordinary_connections_and_probes_can_be_regrouped() -> None:
    network = pair()
    first, second, _ = network.ensembles
    with network:
        nengo.Connection(first, second, synapse=None)
        nengo.Connection(first, second, solver=Lstsq(weights=True), synapse=FAST)
        sparse = nengo.Sparse((5, 5), indices=[(0, 1)])
        nengo.Connection(first.neurons, second.neurons, transform=sparse, synapse=FAST)
        nengo.Connection(nengo.Node([1]), first, synapse=nengo.Alpha(0.1))
        nengo.Probe(first)
        for attr in ("output", "voltage", "input"):
            nengo.Probe(first.neurons, attr)
    assert regroupable_labels(network) == ["first", "second", "other"]


def convolution(network: nengo.Network) -> None:
    first, _, other = network.ensembles
    transform = nengo.Convolution(1, (5, 1), kernel_size=(1,), strides=(1,))
    nengo.Connection(first.neurons, other.neurons, transform=transform, synapse=FAST)


def learning(network: nengo.Network) -> None:
    error = nengo.Node([0])
    learned = nengo.Connection(
        network.ensembles[0], network.ensembles[2], learning_rule_type=nengo.PES()
    )
    nengo.Connection(error, learned.learning_rule)


def not_compositional(network: nengo.Network) -> None:
    solver = nengo.solvers.NnlsL2(weights=True)
    solver.compositional = False
    nengo.Connection(network.ensembles[0], network.ensembles[2], solver=solver, synapse=FAST)


def weights_from_the_host(network: nengo.Network) -> None:
    spikeport.add_params(network)
    network.config[network.ensembles[0]].on_chip = False
    solver = nengo.solvers.LstsqL2(weights=True)
    nengo.Connection(network.ensembles[0], network.ensembles[2], solver=solver, synapse=FAST)


def other_filter(network: nengo.Network) -> None:
    nengo.Connection(network.ensembles[0], network.ensembles[2], synapse=nengo.Alpha(0.01))


def probed_weights(network: nengo.Network) -> None:
    nengo.Probe(nengo.Connection(network.ensembles[0], network.ensembles[2]), "weights")


@pytest.mark.parametrize(
    "change",
    [
        convolution,
        learning,
        not_compositional,
        weights_from_the_host,
        other_filter,
        probed_weights,
    ],
)
def test_ends_of_special_connections_cannot_be_regrouped(
    change: Callable[[nengo.Network], None],
) -> None:
    network = pair()
    with network:
        change(network)
    assert regroupable_labels(network) == ["second"]


def block_shape(network: nengo.Network) -> None:
    network.config[network.ensembles[0]].block_shape = nengo_loihi.BlockShape((5,), (5,))


def probed_refractory_time(network: nengo.Network) -> None:
    nengo.Probe(network.ensembles[0].neurons, "refractory_time")


def noisy(network: nengo.Network) -> None:
    network.ensembles[0].noise = nengo.processes.WhiteNoise()


def gain_alone(network: nengo.Network) -> None:
    network.ensembles[0].gain = np.ones(5)


def other_neurons(network: nengo.Network) -> None:
    network.ensembles[0].neuron_type = nengo.AdaptiveLIF()


def other_rates(network: nengo.Network) -> None:
    network.ensembles[0].neuron_type = nengo.RegularSpiking(nengo.Tanh())


@pytest.mark.parametrize(
    "change",
    [block_shape, probed_refractory_time, noisy, gain_alone, other_neurons, other_rates],
)
def test_special_ensembles_cannot_be_regrouped(change: Callable[[nengo.Network], None]) -> None:
    network = pair()
    with network:
        change(network)
    assert regroupable_labels(network) == ["second", "other"]


def test_regular_spiking_neurons_can_be_regrouped() -> None:
    network = pair()
    network.ensembles[0].neuron_type = nengo.RegularSpiking(nengo.LIFRate())
    assert regroupable_labels(network) == ["first", "second", "other"]


def test_ensembles_at_passthrough_nodes_that_stay_cannot_be_regrouped() -> None:
    network = pair()
    with network:
        nengo.Connection(network.nodes[0], network.nodes[0], synapse=SLOW)
    assert regroupable_labels(network) == ["other"]


def behind_two_filters() -> nengo.Network:
    """Return a network whose values pass a node that stays, and then one that is folded."""
    with nengo.Network(seed=3) as network:
        a, b = nengo.Ensemble(80, 1, label="a"), nengo.Ensemble(80, 1, label="b")
        stays, folded = nengo.Node(size_in=1, label="stays"), nengo.Node(size_in=1, label="folded")
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a, stays, synapse=0.05)
        nengo.Connection(nengo.Node(lambda t: -0.5 * (t > 0.1)), stays, synapse=None)
        nengo.Connection(stays, folded, synapse=0.05)
        nengo.Connection(folded, b, synapse=None)
        network.probe = nengo.Probe(b, synapse=0.005)
    return network


def test_targets_of_nodes_that_stay_are_not_regrouped_even_behind_folded_ones() -> None:
    network = behind_two_filters()
    assert [node.label for node in foldable(scope_of(network))] == ["folded"]
    assert regroupable_labels(network) == []


def test_inputs_behind_nodes_that_stay_keep_their_filters() -> None:
    """The host's step arrives long before the values of a: one filter for both would delay it."""
    network = behind_two_filters()
    found = {}
    for passes in ("as_written", "compact"):
        with spikeport.Simulator(network, pipeline=passes) as sim:
            sim.run(0.25)
        found[passes] = sim.data[network.probe]
    assert relative_rms(found["compact"], found["as_written"]) < 0.2
