"""Passthrough nodes, and which of them can be folded into connections."""

from collections.abc import Callable

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.compile.ground.scope import is_passthrough
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.passthrough import foldable
from tests.helpers.small_networks import FAST, SLOW, scope_of


def labels(network: nengo.Network) -> list[str]:
    return [node.label for node in foldable(scope_of(network))]


def line(
    *synapses: nengo.synapses.Synapse | None, order: tuple[int, ...] | None = None
) -> nengo.Network:
    """Return ``a``, nodes 0, 1 and so on, and ``b``, in a row; nodes are defined in an order."""
    n = len(synapses) - 1
    with nengo.Network() as network:
        a, b = nengo.Ensemble(5, 1, label="a"), nengo.Ensemble(5, 1, label="b")
        nodes = {i: nengo.Node(size_in=1, label=str(i)) for i in order or range(n)}
        row = [a, *(nodes[i] for i in range(n)), b]
        for pre, post, synapse in zip(row, row[1:], synapses, strict=False):
            nengo.Connection(pre, post, synapse=synapse)
    return network


def test_nodes_without_a_function_pass_through() -> None:
    with nengo.Network():
        assert is_passthrough(nengo.Node(size_in=1))
        assert not is_passthrough(nengo.Node([1]))
        assert not is_passthrough(nengo.Node(lambda t, x: x, size_in=1))
        assert not is_passthrough(nengo.Ensemble(3, 1))


def test_foldable_nodes_are_ordered_from_source_to_target() -> None:
    assert labels(line(None, None, None, None, order=(2, 0, 1))) == ["0", "1", "2"]


@pytest.mark.parametrize("synapses", [(FAST, None, None), (None, FAST, None), (None, None, FAST)])
def test_one_filter_may_be_anywhere_on_the_path_of_foldable_nodes(
    synapses: tuple[nengo.synapses.Synapse, ...],
) -> None:
    assert labels(line(*synapses)) == ["0", "1"]


@pytest.mark.parametrize(
    ("synapses", "foldable"),
    [
        ((FAST, SLOW), []),
        ((FAST, None, FAST), ["0"]),
        ((None, FAST, FAST, None), ["0", "2"]),
        ((FAST, SLOW, FAST), []),
        ((FAST, SLOW, None, None, FAST, None), ["1", "2", "4"]),
    ],
)
def test_a_node_from_which_a_second_filter_leads_on_is_not_foldable(
    synapses: tuple[nengo.synapses.Synapse, ...], foldable: list[str]
) -> None:
    assert labels(line(*synapses)) == foldable


def test_a_node_with_filters_on_parallel_paths_is_foldable() -> None:
    network = line(None, FAST)
    with network:
        nengo.Connection(network.nodes[0], network.ensembles[1], synapse=SLOW)
        nengo.Connection(network.ensembles[1], network.nodes[0], synapse=None)
    assert labels(network) == ["0"]


def test_a_node_with_two_filters_on_one_of_several_paths_is_not_foldable() -> None:
    network = line(None, FAST)
    with network:
        nengo.Connection(network.ensembles[1], network.nodes[0], synapse=SLOW)
    assert labels(network) == []


def test_nodes_in_a_loop_are_not_foldable() -> None:
    network = line(None, None, FAST)
    with network:
        nengo.Connection(network.nodes[1], network.nodes[0], synapse=SLOW)
    assert labels(network) == []


def test_nodes_in_a_loop_through_ensembles_are_foldable() -> None:
    network = line(None, None, FAST)
    with network:
        nengo.Connection(network.ensembles[1], network.nodes[0], synapse=None)
    assert labels(network) == ["0", "1"]


def convolved(network: nengo.Network) -> None:
    transform = nengo.Convolution(1, (1, 1), kernel_size=(1,), strides=(1,))
    nengo.Connection(network.nodes[0], network.ensembles[1], transform=transform, synapse=FAST)


def learned(network: nengo.Network) -> None:
    rule = nengo.Connection(
        network.ensembles[0], network.nodes[0], learning_rule_type=nengo.PES()
    ).learning_rule
    nengo.Connection(nengo.Node([0]), rule)


def learned_from(network: nengo.Network) -> None:
    a, b = network.ensembles
    rule = nengo.Connection(a, b, learning_rule_type=nengo.PES()).learning_rule
    nengo.Connection(network.nodes[0], rule, synapse=None)


def probed(network: nengo.Network) -> None:
    nengo.Probe(network.connections[0])


@pytest.mark.parametrize("change", [convolved, learned, learned_from, probed])
def test_nodes_at_convolved_learned_or_probed_connections_are_not_foldable(
    change: Callable[[nengo.Network], None],
) -> None:
    network = line(None, None)
    assert labels(network) == ["0"]
    with network:
        change(network)
    assert labels(network) == []


def with_error_node() -> nengo.Network:
    """Return a network with a PES connection whose source also feeds the node of its error."""
    with nengo.Network(seed=1) as network:
        pre, post = (nengo.Ensemble(20, 1, label=label) for label in ("pre", "post"))
        error = nengo.Node(size_in=1, label="error")
        rule = nengo.PES(1e-4)
        learned = nengo.Connection(pre, post, learning_rule_type=rule, function=lambda x: 0)
        nengo.Connection(nengo.Node(0.5), pre)
        nengo.Connection(post, error)
        nengo.Connection(pre, error, transform=-1)
        nengo.Connection(error, learned.learning_rule, synapse=None)
    return network


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_only_the_target_of_a_learned_connection_is_on_the_host(pipeline: str) -> None:
    report = compile_network(with_error_node(), pipeline=pipeline).report
    assert [one.object for one in report.on_host] == ["post"]


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_connection_into_a_node_can_be_probed(pipeline: str) -> None:
    with nengo.Network() as network:
        node = nengo.Node(size_in=1)
        into = nengo.Connection(nengo.Node(0.5), node, synapse=None)
        nengo.Connection(node, nengo.Ensemble(5, 1))
        probe = nengo.Probe(into)
    with Simulator(network, pipeline=pipeline) as sim:
        sim.run_steps(3)
        assert sim.data[probe][-1] == 0.5


def test_a_node_that_receives_a_function_is_foldable() -> None:
    network = line(None, FAST)
    with network:
        nengo.Connection(network.ensembles[1], network.nodes[0], function=np.square, synapse=None)
    assert labels(network) == ["0"]


def test_nodes_between_objects_on_the_host_are_not_foldable() -> None:
    network = line(None, FAST)
    with network:
        away = nengo.Node(size_in=1, label="away")
        nengo.Connection(nengo.Node([1]), away)
        nengo.Connection(away, nengo.Node(lambda t, x: None, size_in=1))
        nengo.Node(size_in=1, label="alone")
    assert labels(network) == ["0"]


def test_a_loop_in_one_cluster_leaves_other_nodes_foldable() -> None:
    network = line(None, FAST)
    with network:
        a, b = network.ensembles
        looped = nengo.Node(size_in=1, label="looped")
        nengo.Connection(a, looped, synapse=None)
        nengo.Connection(looped, looped, synapse=FAST)
        nengo.Connection(looped, b, synapse=None)
    assert labels(network) == ["0"]


def test_a_network_without_nodes_has_no_foldable_nodes() -> None:
    assert labels(line(FAST)) == []
