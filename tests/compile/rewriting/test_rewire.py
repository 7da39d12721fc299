"""Connections that are rewired to take a path: directly, over relays or over the host."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.links import link
from spikeport.compile.rewriting.rewire import rewire
from tests.helpers.small_networks import DT_S, FAST, SLOW, decode, decoders, ensemble, rewrite_of


def chain() -> nengo.Network:
    with nengo.Network(seed=3) as network:
        spikeport.add_params(network)
        a, b = ensemble("a", 4), ensemble("b", 3, 2, radius=0.5)
        decode(a, b[1], decoders(4, 1), transform=3, synapse=SLOW)
        nengo.Connection(nengo.Node([1]), a)
        nengo.Probe(b)
    return network


def rewired(network: nengo.Network, path: str) -> Rewrite:
    rewrite = rewrite_of(network)
    solver = ParameterSolver(rewrite, DT_S)
    filters = dict.fromkeys(network.ensembles, 0.005)
    connection = network.connections[0]
    links = {connection: link(connection, solver)}
    return rewire(rewrite, {connection: path}, links, filters, solver)


def test_direct_wiring_is_encoders_times_decoders() -> None:
    network = chain()
    old, other = network.connections
    after = rewired(network, "direct")
    assert old not in after.network.connections
    assert other in after.network.connections
    (new,) = [c for c in after.network.connections if c is not other]
    a, b = network.ensembles
    assert (new.pre_obj, new.post_obj, new.synapse) == (a.neurons, b.neurons, SLOW)
    expected = np.outer([2, 4, 6], 3 * decoders(4, 1)[:, 0]) / 0.5
    np.testing.assert_allclose(new.transform.sample(), expected)
    assert after.network.config[new].decode_path == "direct"
    np.testing.assert_array_equal(after.built[old].weights, 3 * decoders(4, 1).T)


def test_a_slice_of_neurons_is_wired_directly_and_over_the_host() -> None:
    with nengo.Network(seed=3) as network:
        spikeport.add_params(network)
        a, b = ensemble("a", 4), ensemble("b", 3)
        nengo.Connection(a.neurons[1:3], b, transform=[[5, 7]], synapse=FAST)
    (new,) = rewired(network, "direct").network.connections
    assert new.pre_obj == a.neurons
    expected = np.outer([1, 2, 3], [0, 5, 7, 0])
    np.testing.assert_array_equal(new.transform.sample().toarray(), expected)
    into, _ = rewired(network, "host").network.connections
    assert (into.pre_obj, into.pre_slice) == (a.neurons, slice(1, 3))


def test_the_path_over_the_host_has_a_node_between_decoders_and_encoders() -> None:
    network = chain()
    old, other = network.connections
    after = rewired(network, "host")
    into, out = [c for c in after.network.connections if c is not other]
    a, b = network.ensembles
    node = into.post_obj
    assert (into.pre_obj, out.pre_obj, out.post_obj) == (a, node, b)
    assert node.output is not None  # no passthrough node, which would be removed again
    assert node.output(0.0, np.array([0.3])) == [0.3]
    assert (into.synapse, out.synapse) == (SLOW, None)
    assert (into.solver, into.function) == (old.solver, old.function)
    assert into.transform == old.transform
    np.testing.assert_array_equal(out.transform.sample(), [[0], [1]])
    assert after.seeds[into] == rewrite_of(network).all_seeds()[old]
    assert old in after.built


def test_the_host_reads_sparse_transforms_as_dense_ones() -> None:
    network = chain()
    old = network.connections[0]
    old.transform = nengo.Sparse((1, 1), init=[[0.5]], indices=[[0, 0]])
    into, *_ = [c for c in rewired(network, "host").network.connections if c.pre_obj is old.pre_obj]
    np.testing.assert_array_equal(into.transform.sample(), [[0.5]])


@pytest.mark.parametrize("path", ["onoff", "preset10"])
def test_relays_are_left_to_the_builder(path: str) -> None:
    network = chain()
    old, other = network.connections
    after = rewired(network, path)
    assert after.network.connections == [old, other]
    assert after.network.config[old].decode_path == path
    assert old not in after.built


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("path", ["direct", "onoff", "preset10", "host"])
def test_sparse_transforms_of_decoded_values_take_every_path(path: str, twice: bool) -> None:
    with nengo.Network(seed=3) as network:
        spikeport.add_params(network)
        a, b = nengo.Ensemble(20, 2), nengo.Ensemble(20, 2)
        transform = nengo.Sparse((2, 2), indices=[[0, 1], [1, 0]], init=[0.5, -1])
        nengo.Connection(a[[1, 1]] if twice else a, b, transform=transform, synapse=0.1)
        nengo.Connection(nengo.Node([0.0, 0.0]), b, synapse=0.005)
    (old, _) = network.connections
    after = rewired(network, path)
    assert old not in after.network.connections
    assert old in after.built
    spikeport.compile_network(network, pipeline=f"decode_path{{default={path}}}")


def test_relays_of_sparse_transforms_get_dense_ones_and_stay_the_same_otherwise() -> None:
    network = chain()
    old, other = network.connections
    old.transform = nengo.Sparse((1, 1), init=[[0.5]], indices=[[0, 0]])
    after = rewired(network, "onoff")
    (new,) = [c for c in after.network.connections if c is not other]
    assert (new.pre, new.post, new.synapse) == (old.pre, old.post, old.synapse)
    assert (new.solver, new.function) == (old.solver, old.function)
    np.testing.assert_array_equal(new.transform.sample(), [[0.5]])
    assert after.network.config[new].decode_path == "onoff"
    assert after.seeds[new] == rewrite_of(network).all_seeds()[old]


def test_everything_else_stays() -> None:
    network = chain()
    after = rewired(network, "direct")
    assert after.network.ensembles == network.ensembles
    assert after.network.nodes == network.nodes
    assert after.network.probes == network.probes
    assert not after.stand_ins
