"""Flat networks of groups: their ensembles, constants and connections."""

from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest
from nengo.solvers import NoSolver

import spikeport
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.assembly import Assembly
from spikeport.compile.rewriting.partition import Part, Partition
from tests.helpers.small_networks import (
    DT_S,
    FAST,
    SLOW,
    decode,
    decoders,
    ensemble,
    matrices_of,
    rewrite_of,
    whole,
)


def assembled(network: nengo.Network, partition: Partition) -> Assembly:
    """Return the assembled network of a partition, with all nodes except passthrough nodes."""
    rewrite = rewrite_of(network)
    solver = ParameterSolver(rewrite, DT_S)
    edges = matrices_of(network, partition).edges
    assembly = Assembly(rewrite, solver, partition, edges)
    for obj in (*network.all_ensembles, *network.all_nodes):
        if obj not in partition and getattr(obj, "output", True) is not None:
            assembly.flat.keep(obj)
    assembly.connect()
    return assembly


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_compile_within_the_context_of_a_network_leaves_it_unchanged(pipeline: str) -> None:
    with nengo.Network(seed=7) as network:
        a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 2)
        nengo.Connection(a, b[0])
        nengo.Probe(b)
    outside = spikeport.compile_network(network, pipeline=pipeline).image.digest
    with network:
        for _ in range(2):
            assert spikeport.compile_network(network, pipeline=pipeline).image.digest == outside
        with spikeport.Simulator(network, pipeline=pipeline) as sim:
            sim.run_steps(2)
        assert network.networks == []
        assert len(network.all_objects) == 4


def test_a_group_is_its_parts_laid_end_to_end() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4, 2), ensemble("b", 3, radius=3.0)
    group, rest = assembled(
        network, Partition([[Part(a, 1, 3), Part(b, 0, 3)], [Part(a, 0, 1)]])
    ).ensembles
    np.testing.assert_array_equal(group.gain, [2, 3, 1, 2, 3])
    np.testing.assert_array_equal(group.bias, [0.1, 0.2, 0, 0.1, 0.2])
    np.testing.assert_array_equal(
        group.encoders, [[3, 4, 0], [5, 6, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]]
    )
    assert group.radius == 3
    assert rest.radius == 1
    assert not group.normalize_encoders


def test_labels_of_groups_name_their_parts() -> None:
    with nengo.Network(seed=1) as network:
        a, b, c = (ensemble(label, 4) for label in "abc")
    cut = [[Part(a, 0, 2)], [Part(b, 0, 4), Part(c, 0, 4)], [Part(a, 2, 4)]]
    labels = [one.label for one in assembled(network, Partition(cut)).ensembles]
    assert labels == ["a[1/2]", "b .. c", "a[2/2]"]
    assert [one.label for one in assembled(network, whole(a)).ensembles] == ["a"]


def test_neurons_of_a_group_keep_their_initial_voltages() -> None:
    start = {"voltage": nengo.dists.Uniform(0, 1)}
    with nengo.Network(seed=1) as network:
        kind = nengo.LIF(tau_rc=0.03, initial_state=start)
        a, b = (ensemble(label, 4, neuron_type=kind) for label in "ab")
    solver = ParameterSolver(rewrite_of(network), DT_S)
    (group,) = assembled(network, Partition([[Part(b, 1, 4), Part(a, 0, 2)]])).ensembles
    voltages = [solver.initial_state(e)["voltage"] for e in (b, a)]
    expected = np.concatenate([voltages[0][1:], voltages[1][:2]])
    state = group.neuron_type.make_state(5, rng=np.random)
    np.testing.assert_array_equal(state["voltage"], expected)
    assert len(set(expected)) == 5
    assert group.neuron_type.tau_rc == 0.03


def test_a_group_has_the_evaluation_points_of_its_parts() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4, 2, radius=3), ensemble("b", 5, n_eval_points=10)
        c = ensemble("c", 3, eval_points=[[0.5]])
    solver = ParameterSolver(rewrite_of(network), DT_S)
    (group,) = assembled(network, whole((a, b, c))).ensembles
    points = [solver.ensemble(one).eval_points / one.radius for one in (a, b)]
    assert len(group.eval_points) == min(len(points[0]), 1_000)
    np.testing.assert_array_equal(group.eval_points[:15, :2], points[0][:15])
    np.testing.assert_array_equal(group.eval_points[:15, 2], [*points[1][:, 0], *points[1][:5, 0]])
    np.testing.assert_array_equal(group.eval_points[:, 3], 0.5)


def test_some_neuron_fires_at_the_evaluation_point_of_a_group_that_is_silent_at_its_own() -> None:
    with nengo.Network(seed=1) as network:
        a, silent = ensemble("a", 4, 2, eval_points=np.zeros((1, 2))), ensemble("silent", 2)
    a.gain, a.bias = np.array([9.0, 1.0, 1.0, 1.0]), np.zeros(4)  # the first's encoder is shortest
    silent.gain = np.zeros(2)
    fires, never = assembled(network, whole(a, silent)).ensembles
    current = fires.gain * (fires.encoders @ fires.eval_points[0]) / fires.radius + fires.bias
    assert current.max() == pytest.approx(1e3)
    np.testing.assert_array_equal(never.eval_points, [[0.0]])


def connections(assembly: Assembly, pre: Any = None, post: Any = None) -> list[nengo.Connection]:
    return [
        c
        for c in assembly.flat.network.connections
        if pre in (None, c.pre_obj) and post in (None, c.post_obj)
    ]


def dense(connection: nengo.Connection) -> np.ndarray:
    init = connection.transform.init
    matrix = init if isinstance(init, np.ndarray) else init.toarray()
    return matrix if matrix.ndim == 2 else np.diag(matrix)


def path(assembly: Assembly, connection: nengo.Connection) -> str:
    return str(assembly.flat.network.config[connection].decode_path)


def test_constant_input_becomes_bias() -> None:
    with nengo.Network(seed=1) as network:
        a = ensemble("a", 3, 2, radius=2)
        constant = nengo.Node([0.3, 0.5])
        nengo.Connection(constant, a, transform=4, synapse=None)
        nengo.Connection(constant[0], a.neurons, transform=[[1], [0], [2]], synapse=None)
    assembly = assembled(network, whole(a))
    encoded = np.array([[1, 2], [3, 4], [5, 6]]) @ [1.2, 2.0] / 2 + [0.3, 0, 0.6]
    np.testing.assert_allclose(assembly.ensembles[0].bias, [0, 0.1, 0.2] + a.gain * encoded)
    assert not assembly.flat.network.connections


def varying(_t: float) -> list[float]:
    return [0.3]


@pytest.mark.parametrize(("output", "synapse"), [(varying, None), ([0.3], FAST)])
def test_varying_or_filtered_input_does_not_become_bias(output: Any, synapse: Any) -> None:
    with nengo.Network(seed=1) as network:
        a = ensemble("a", 3)
        nengo.Connection(nengo.Node(output), a, synapse=synapse)
    assembly = assembled(network, whole(a))
    np.testing.assert_array_equal(assembly.ensembles[0].bias, [0, 0.1, 0.2])
    assert len(assembly.flat.network.connections) == 2


def test_constants_are_still_sent_to_objects_that_stay() -> None:
    with nengo.Network(seed=1) as network:
        a, node = ensemble("a", 3), nengo.Node(size_in=1)
        constant = nengo.Node([0.3])
        sink = nengo.Node(lambda t, x: None, size_in=1, label="sink")
        nengo.Connection(constant, node, synapse=None)
        nengo.Connection(node, a, synapse=None)
        nengo.Connection(node, sink, transform=2, synapse=None)
    assembly = assembled(network, whole(a))
    (left,) = assembly.flat.network.connections
    assert (left.pre_obj, left.post_obj) == (constant, sink)
    np.testing.assert_array_equal(dense(left), [[2]])


def test_values_that_the_host_sends_are_summed_on_the_host() -> None:
    with nengo.Network(seed=1) as network:
        a = ensemble("a", 3, 3, radius=2)
        first, second = (nengo.Node(lambda t: [t, t], label=label) for label in ("x", "y"))
        nengo.Connection(first, a[[2, 0]], transform=3, synapse=FAST)
        nengo.Connection(second[1], a[2], synapse=SLOW)
    assembly = assembled(network, whole(a))
    (group,) = assembly.ensembles
    (node,) = [n for n in assembly.flat.network.nodes if n.label == "a input"]
    (wired,) = connections(assembly, post=group.neurons)
    assert (wired.pre_obj, wired.synapse, path(assembly, wired)) == (node, None, "direct")
    np.testing.assert_array_equal(dense(wired), [[1, 3], [4, 6], [7, 9]])
    (fast,), (slow,) = connections(assembly, first), connections(assembly, second)
    assert (fast.synapse, slow.synapse) == (FAST, SLOW)
    np.testing.assert_array_equal(dense(fast), [[0, 1.5], [1.5, 0]])
    np.testing.assert_array_equal(dense(slow), [[0, 0], [0, 0.5]])


def test_values_that_the_host_reads_are_decoded_by_one_connection() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4), ensemble("b", 3)
        first = nengo.Node(lambda t, x: None, size_in=3, label="x")
        second = nengo.Node(lambda t, x: None, size_in=1, label="y")
        decode(a, first[[2, 0]], values := decoders(4, 2), synapse=FAST)
        decode(b, second, large := 100 * decoders(3, 1), synapse=SLOW)
    assembly = assembled(network, whole((a, b)))
    (group,) = assembly.ensembles
    (node,) = [n for n in assembly.flat.network.nodes if n.label == "a .. b output"]
    (decoded,) = connections(assembly, group, node)
    assert decoded.synapse is None
    assert isinstance(decoded.solver, NoSolver)
    (to_first,), (to_second,) = (
        connections(assembly, post=first),
        connections(assembly, post=second),
    )
    assert (to_first.synapse, to_second.synapse) == (FAST, SLOW)
    scaled = decoded.solver.values.T
    np.testing.assert_allclose(
        np.abs(scaled).max(axis=1), np.abs(scaled).max()
    )  # all rows make the same use of a weight's bits
    found = dense(to_first) @ scaled[to_first.pre_slice]
    expected = np.zeros((3, 7))
    expected[[2, 0], :4] = values.T
    np.testing.assert_allclose(found, expected)
    np.testing.assert_allclose(
        dense(to_second) @ scaled[to_second.pre_slice], [[0] * 4 + [*large[:, 0]]]
    )


def test_values_for_all_of_a_target_on_the_host_take_no_matrix() -> None:
    """A matrix for thousands of values would take gigabytes, nearly all of them zeros."""
    with nengo.Network(seed=1) as network:
        a = ensemble("a", 4)
        node = nengo.Node(lambda t, x: None, size_in=3, label="x")
        decode(a, node, values := decoders(4, 3), synapse=FAST)
    assembly = assembled(network, whole(a))
    (group,), (output,) = (
        assembly.ensembles,
        [n for n in assembly.flat.network.nodes if n.label == "a output"],
    )
    (decoded,) = connections(assembly, group, output)
    (to_node,) = connections(assembly, post=node)
    assert to_node.transform.init.shape == (3,)
    np.testing.assert_allclose(dense(to_node) @ decoded.solver.values.T, values.T)


def test_neurons_that_the_host_reads_keep_a_dense_transform() -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        a, mean = nengo.Ensemble(50, 1), nengo.Node(size_in=1)
        network.config[a].block_shape = nengo_loihi.BlockShape((25,), (50,))  # so that it stays
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a.neurons[:10], mean, transform=np.full((1, 10), 0.1), synapse=0.02)
        probe = nengo.Probe(mean)
    rates_hz = []
    for pipeline in ("as_written", "compact"):
        with spikeport.Simulator(network, pipeline=pipeline) as sim:
            sim.run(0.2)
            rates_hz.append(sim.data[probe][-1])
    assert rates_hz[0] > 10
    assert rates_hz[1] == pytest.approx(rates_hz[0], rel=0.1)


def test_groups_are_wired_from_neurons_to_dimensions_and_to_neurons() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4), ensemble("b", 3, 2)
        decode(a, b, values := decoders(4, 2), synapse=FAST)
        nengo.Connection(a.neurons[:3], b.neurons, synapse=SLOW)
    assembly = assembled(network, whole(a, b))
    pre, post = assembly.ensembles
    (decoded,), (wired,) = (
        connections(assembly, post=post),
        connections(assembly, post=post.neurons),
    )
    assert decoded.pre_obj == wired.pre_obj == pre.neurons
    assert (decoded.synapse, wired.synapse) == (FAST, SLOW)
    np.testing.assert_array_equal(dense(decoded), values.T)
    np.testing.assert_array_equal(dense(wired), np.eye(3, 4))
    assert [path(assembly, c) for c in (decoded, wired)] == ["auto", "direct"]


def test_a_decode_path_that_is_set_stays_set() -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        a, b = ensemble("a", 4), ensemble("b", 3)
        network.config[decode(a, b, decoders(4, 1))].decode_path = "onoff"
    assembly = assembled(network, whole(a, b))
    assert [path(assembly, c) for c in assembly.flat.network.connections] == ["onoff"]


def test_ensembles_that_stay_keep_their_decoders_and_seed() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4), ensemble("b", 3)
        old = nengo.Connection(
            a, b, function=np.square, eval_points=np.ones((5, 1)), transform=3, synapse=FAST
        )
    assembly = assembled(network, whole(b))
    (new,) = connections(assembly, a, assembly.ensembles[0])
    assert new.function is old.function
    assert new.solver is old.solver
    np.testing.assert_array_equal(new.eval_points, old.eval_points)
    np.testing.assert_array_equal(dense(new), [[3]])
    assert assembly.flat.seeds[new] == rewrite_of(network).all_seeds()[old]


def learning_inside() -> nengo.Network:
    """Return a network that learns in a subnetwork, with the node of its error outside."""
    with nengo.Network(seed=1) as network:
        u, pre = nengo.Node(0.5, label="u"), nengo.Ensemble(20, 1, label="pre")
        error = nengo.Node(lambda _t, x: x - 0.3, size_in=1, label="error")
        with nengo.Network():
            inner, out = nengo.Ensemble(20, 1, label="inner"), nengo.Node(size_in=1, label="out")
            learned = nengo.Connection(inner, out, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
        nengo.Connection(u, pre)
        nengo.Connection(pre, inner)
        nengo.Connection(out, error)
        nengo.Probe(out, synapse=0.02)
    return network


@pytest.mark.parametrize("pipeline", ["fuse", "decode_path", "compact"])
def test_learning_inside_a_subnetwork_compiles_and_learns(pipeline: str) -> None:
    network = learning_inside()
    with spikeport.Simulator(network, pipeline=pipeline) as simulator:
        assert simulator.compilation.image.learns.sum() == 1
        simulator.run_steps(500)
    value = simulator.data[network.probes[0]]
    assert value[100:200].mean() == pytest.approx(0.5, abs=0.05)
    assert value[400:].mean() < 0.46  # on the way to 0.3
