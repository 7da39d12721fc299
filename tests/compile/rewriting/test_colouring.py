import itertools
from collections.abc import Callable, Sequence
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest
from nengo.solvers import Lstsq

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


def test_neuron_types_tell_apart() -> None:
    slow = nengo.LIF(tau_rc=0.05)
    assert groups(network_of("abc", [], b=slow)) == ["ac", "b"]
    assert groups(network_of("abc", [], b=slow, c=slow)) == ["a", "bc"]
    assert groups(network_of("ab", [], b=nengo.SpikingRectifiedLinear())) == ["a", "b"]


def test_where_neurons_start_tells_nothing_apart() -> None:
    zero = nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])})
    assert groups(network_of("ab", [], b=zero)) == ["ab"]


def test_synapses_tell_apart() -> None:
    edges = [("a", "c", FAST), ("b", "c", SLOW)]
    assert groups(network_of("abc", edges)) == ["a", "b", "c"]
    assert groups(network_of("abc", [("a", "c", FAST), ("b", "c", FAST)])) == ["ab", "c"]


def test_inputs_tell_apart_what_sends_alike() -> None:
    edges = [("c", "a", FAST), ("c", "b", SLOW)]
    assert groups(network_of("abc", edges)) == ["a", "b", "c"]


def test_directions_tell_apart() -> None:
    assert groups(network_of("ab", [("a", "b", FAST)])) == ["a", "b"]
    assert groups(network_of("ab", [("a", "b", FAST), ("b", "a", FAST)])) == ["ab"]


def test_neurons_and_values_tell_apart() -> None:
    network = network_of("abc", [("a", "c", FAST), ("b", "c", FAST)])
    assert groups(network) == ["ab", "c"]
    a, b, c = network.ensembles
    with network:
        nengo.Connection(a.neurons, c, transform=np.ones((1, 5)), synapse=FAST)
        nengo.Connection(b, c.neurons, transform=np.ones((5, 1)), synapse=FAST)
    assert groups(network) == ["a", "b", "c"]


@pytest.mark.parametrize("nodes", ["", "xy"])
def test_neighbours_of_neighbours_tell_apart(nodes: str) -> None:
    """In two chains, maybe over passthrough nodes, only the last ensembles have other inputs."""
    first = [("a", nodes[0], None), (nodes[0], "b", FAST)] if nodes else [("a", "b", FAST)]
    second = [("d", nodes[1], None), (nodes[1], "e", FAST)] if nodes else [("d", "e", FAST)]
    chains = [*first, ("b", "c", FAST), *second, ("e", "f", FAST)]
    assert groups(network_of("abcdef", chains, nodes)) == ["ad", "be", "cf"]
    other = [*chains, ("c", "c", SLOW)]
    assert groups(network_of("abcdef", other, nodes)) == ["a", "b", "c", "d", "e", "f"]


def test_numbers_of_neighbours_tell_nothing_apart() -> None:
    edges = [("c", "a", FAST), ("c", "b", FAST), ("d", "b", FAST), ("d", "a", FAST)]
    assert groups(network_of("abcd", edges)) == ["ab", "cd"]
    assert groups(network_of("abcd", edges[:-1])) == ["ab", "cd"]


def test_nodes_that_stay_are_all_one() -> None:
    network = network_of("ab", [])
    with network:
        for end in network.ensembles:
            nengo.Connection(nengo.Node([0.5]), end)
    assert groups(network) == ["ab"]


def test_passthrough_nodes_are_other_than_nodes_that_stay() -> None:
    network = network_of("ab", [("x", "a", FAST)], "x")
    with network:
        nengo.Connection(nengo.Node([0.5]), network.ensembles[1], synapse=FAST)
    assert groups(network) == ["a", "b"]


def test_only_some_ensembles_are_grouped() -> None:
    network = network_of("abc", [])
    a, _, c = network.ensembles
    assert alike(scope_of(network), [a, c]) == [[a, c]]


def test_ensembles_that_stay_are_other_than_those_that_do_not() -> None:
    network = network_of("abcd", [("a", "c", FAST), ("b", "d", FAST)])
    a, b, c, _ = network.ensembles
    assert alike(scope_of(network), [a, b, c]) == [[a], [b], [c]]


TREE = [("a", "c", FAST), ("b", "c", FAST), ("d", "f", FAST), ("e", "f", FAST), ("f", "f", SLOW)]


def test_the_order_of_definition_does_not_matter() -> None:
    expected = {"ab", "c", "de", "f"}
    for order in itertools.islice(itertools.permutations("abcdef"), 0, None, 37):
        assert set(groups(network_of("".join(order), TREE))) == expected
    for edges in itertools.permutations(TREE):
        assert set(groups(network_of("fbdace", edges))) == expected


def test_only_neighbours_of_what_has_a_new_colour_are_looked_at(
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


def test_the_first_of_a_group_gives_its_place() -> None:
    assert groups(network_of("fbdace", TREE)) == ["f", "ab", "de", "c"]


def test_a_key_has_all_parameters_but_the_start() -> None:
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
    """Return two ensembles over an array's passthrough node, all of which can be rewritten."""
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
    return [e.label for e in regroupable(scope, foldable(network, scope.on_chip))]


def test_ensembles_on_the_chip_can_be_regrouped() -> None:
    network = pair()
    network.config[network.ensembles[2]].on_chip = False
    assert regroupable_labels(network) == ["first", "second"]


def test_ensembles_with_ordinary_connections_and_probes_can_be_regrouped() -> None:
    network = pair()
    first, second, _ = network.ensembles
    with network:
        nengo.Connection(first, second, synapse=None)
        nengo.Connection(first, second, solver=Lstsq(weights=True), synapse=FAST)
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


def other_filter(network: nengo.Network) -> None:
    nengo.Connection(network.ensembles[0], network.ensembles[2], synapse=nengo.Alpha(0.01))


def probed_weights(network: nengo.Network) -> None:
    nengo.Probe(nengo.Connection(network.ensembles[0], network.ensembles[2]), "weights")


@pytest.mark.parametrize(
    "change", [convolution, learning, not_compositional, other_filter, probed_weights]
)
def test_ends_of_special_connections_stay(change: Callable[[nengo.Network], None]) -> None:
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
def test_special_ensembles_stay(change: Callable[[nengo.Network], None]) -> None:
    network = pair()
    with network:
        change(network)
    assert regroupable_labels(network) == ["second", "other"]


def test_regular_spiking_neurons_can_be_regrouped() -> None:
    network = pair()
    network.ensembles[0].neuron_type = nengo.RegularSpiking(nengo.LIFRate())
    assert regroupable_labels(network) == ["first", "second", "other"]


def test_ensembles_at_passthrough_nodes_that_stay_stay() -> None:
    network = pair()
    with network:
        nengo.Connection(network.nodes[0], network.nodes[0], synapse=SLOW)
    assert regroupable_labels(network) == ["other"]
