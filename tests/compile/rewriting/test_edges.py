"""Edges: the matrices between groups that connections and passthrough nodes amount to."""

from dataclasses import replace
from typing import Any

import nengo
import numpy as np
import pytest
from nengo.solvers import LstsqL2

import spikeport
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.edges import (
    NO_GROUP,
    EdgeKey,
    EdgeMatrices,
    Edges,
    EdgeSource,
    EdgeTarget,
    without_zeros,
)
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

RNG = np.random.RandomState(1)
NEURONS_OF_B = EdgeTarget("neurons", 1)


@pytest.fixture(autouse=True)
def _same_numbers() -> None:
    """Draw the same numbers in a test whichever tests ran before."""
    RNG.seed(1)


def two(n_a: int = 6, n_b: int = 5, **options: Any) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        network.a, network.b = ensemble("a", n_a), ensemble("b", n_b, **options)
    return network


def numbers(*shape: int) -> np.ndarray:
    return RNG.uniform(-1, 1, shape)


def placed(matrix: np.ndarray, shape: tuple[int, int], rows: Any, columns: Any) -> np.ndarray:
    """Return zeros of a shape, with a matrix in some of their rows and columns."""
    whole = np.zeros(shape)
    whole[np.ix_(np.arange(shape[0])[rows], np.arange(shape[1])[columns])] = matrix
    return whole


def assert_edges(edges: Edges, expected: dict[EdgeKey, np.ndarray]) -> None:
    assert set(edges) == set(expected)
    for key, matrix in expected.items():
        np.testing.assert_allclose(edges[key].toarray(), matrix, rtol=1e-12, atol=1e-15)


def key(
    source: EdgeSource | int = 0,
    target: EdgeTarget = NEURONS_OF_B,
    synapse: Any = FAST,
    path: str | None = None,
) -> EdgeKey:
    return EdgeKey(EdgeSource(source) if isinstance(source, int) else source, target, synapse, path)


def edges_of(network: nengo.Network) -> Edges:
    return matrices_of(network, whole(network.a, network.b)).edges


def test_the_edge_between_neurons_is_their_transform() -> None:
    network, weights = two(), numbers(5, 6)
    with network:
        nengo.Connection(network.a.neurons, network.b.neurons, transform=weights, synapse=FAST)
    assert_edges(edges_of(network), {key(): weights})


def test_the_edge_of_a_sparse_transform_is_its_matrix() -> None:
    network = two()
    with network:
        # An entry that occurs twice counts twice, and so does a neuron that is read twice.
        places = [(0, 0), (1, 2), (1, 2), (0, 1)]
        transform = nengo.Sparse((2, 3), indices=places, init=[1.0, 2.0, 3.0, 4.0])
        pre, post = network.a.neurons[[4, 4, 1]], network.b.neurons[[4, 0]]
        nengo.Connection(pre, post, transform=transform, synapse=FAST)
    expected = np.zeros((5, 6))
    expected[4, 4], expected[0, 1] = 1 + 4, 2 + 3
    assert_edges(edges_of(network), {key(): expected})


def test_slices_select_rows_and_columns() -> None:
    network, weights = two(), numbers(2, 3)
    with network:
        pre, post = network.a.neurons[1:4], network.b.neurons[[4, 0]]
        nengo.Connection(pre, post, transform=weights, synapse=FAST)
    assert_edges(edges_of(network), {key(): placed(weights, (5, 6), [4, 0], slice(1, 4))})


@pytest.mark.parametrize(
    ("transform", "dense"),
    [
        (2.0, 2 * np.eye(3)),
        (nengo.Dense((3, 3), init=[1.0, 2.0, 3.0]), np.diag([1.0, 2.0, 3.0])),
        (nengo.transforms.NoTransform(3), np.eye(3)),
    ],
)
def test_factors_become_diagonal_matrices(transform: Any, dense: np.ndarray) -> None:
    network = two()
    with network:
        pre, post = network.a.neurons[:3], network.b.neurons[2:]
        nengo.Connection(pre, post, transform=transform, synapse=FAST)
    assert_edges(edges_of(network), {key(): placed(dense, (5, 6), slice(2, 5), slice(0, 3))})


def test_the_edge_of_decoded_values_is_transform_times_decoders() -> None:
    network, values, transform = two(dimensions=3), decoders(6, 2), numbers(2, 2)
    with network:
        decode(network.a, network.b[1:], values, transform=transform, synapse=FAST)
    product = placed(transform @ values.T, (3, 6), slice(1, 3), slice(None))
    assert_edges(edges_of(network), {key(target=EdgeTarget("dimensions", 1)): product})


def test_values_are_in_units_of_the_largest_radius_of_a_group() -> None:
    with nengo.Network(seed=1) as network:
        a, b = ensemble("a", 4), ensemble("b", 5, 2, radius=0.5)
        c = ensemble("c", 3, radius=2)
        decode(a, b, values := decoders(4, 2), synapse=FAST)
        decode(a, c, single := decoders(4, 1), synapse=FAST)
    edges = matrices_of(network, whole(a, (b, c))).edges
    expected = np.vstack([values.T * 2 / 0.5, single.T])
    assert_edges(edges, {key(target=EdgeTarget("dimensions", 1)): expected})


def test_members_of_a_group_have_their_rows_and_columns() -> None:
    with nengo.Network(seed=1) as network:
        a, b, c = ensemble("a", 2), ensemble("b", 3), ensemble("c", 4)
        into = nengo.Connection(c.neurons, b.neurons, transform=numbers(3, 4), synapse=FAST)
        out = nengo.Connection(b.neurons, c.neurons, transform=numbers(4, 3), synapse=FAST)
    edges = matrices_of(network, whole((a, b), c)).edges
    in_matrix = placed(into.transform.init, (5, 4), slice(2, 5), slice(None))
    out_matrix = placed(out.transform.init, (4, 5), slice(None), slice(2, 5))
    assert_edges(edges, {key(1, EdgeTarget("neurons", 0)): in_matrix, key(0): out_matrix})


def test_parts_of_an_ensemble_have_their_rows_and_columns() -> None:
    network, values = two(), decoders(6, 1)
    into, out = numbers(4, 5), numbers(5, 6)
    a, b = network.a, network.b
    with network:
        nengo.Connection(b.neurons, a.neurons[1:5], transform=into, synapse=FAST)
        nengo.Connection(a.neurons, b.neurons, transform=out, synapse=FAST)
        decode(a, a, values, synapse=SLOW)
    parts = Partition([[Part(a, 0, 4)], [Part(b, 0, 5)], [Part(a, 4, 6)]])
    first, second = EdgeTarget("neurons", 0), EdgeTarget("neurons", 2)
    recurrent = {
        key(source, EdgeTarget("dimensions", target), SLOW): values.T[:, mine]
        for source, mine in ((0, slice(0, 4)), (2, slice(4, 6)))
        for target in (0, 2)
    }
    assert_edges(
        matrices_of(network, parts).edges,
        {
            key(1, first): placed(into[:3], (4, 5), slice(1, 4), slice(None)),
            key(1, second): placed(into[3:], (2, 5), [0], slice(None)),
            key(0): out[:, :4],
            key(2): out[:, 4:],
            **recurrent,
        },
    )


def test_the_edge_of_a_solver_of_weights_includes_the_encoders() -> None:
    network = two(dimensions=2, radius=0.5)
    with network:
        solved = nengo.Connection(
            network.a, network.b[1], solver=LstsqL2(weights=True), synapse=FAST
        )
    values = ParameterSolver(rewrite_of(network), DT_S).weights(solved)
    encoders = np.arange(1.0, 11).reshape(5, 2)[:, 1:]
    assert_edges(edges_of(network), {key(): encoders / 0.5 @ values})


def test_weights_of_an_ensemble_that_stays_start_at_its_neurons() -> None:
    network = two()
    with network:
        stays = ensemble("stays", 3)
        solved = nengo.Connection(stays, network.b, solver=LstsqL2(weights=True), synapse=FAST)
    values = ParameterSolver(rewrite_of(network), DT_S).weights(solved)
    source = EdgeSource(NO_GROUP, stays.neurons)
    edge = EdgeKey(source, key().target, FAST, None)
    assert_edges(edges_of(network), {edge: network.b.encoders @ values})


def test_weights_to_an_ensemble_that_stays_on_the_chip_end_at_its_neurons() -> None:
    network = two()
    with network:
        stays = ensemble("stays", 3, 2, radius=0.5)
        solved = nengo.Connection(network.a, stays[1], solver=LstsqL2(weights=True), synapse=FAST)
    values = ParameterSolver(rewrite_of(network), DT_S).weights(solved)
    edge = key(target=EdgeTarget("object", NO_GROUP, stays.neurons))
    assert_edges(edges_of(network), {edge: stays.encoders[:, 1:] / 0.5 @ values})


def test_the_edge_through_a_passthrough_node_is_a_product() -> None:
    network, into, out = two(), numbers(3, 3), numbers(5, 2)
    with network:
        node = nengo.Node(size_in=3)
        nengo.Connection(network.a.neurons[2:5], node, transform=into, synapse=None)
        nengo.Connection(node[::2], network.b.neurons, transform=out, synapse=FAST)
    product = placed(out @ into[::2], (5, 6), slice(None), slice(2, 5))
    assert_edges(edges_of(network), {key(): product})


def test_a_value_that_is_read_twice_counts_twice() -> None:
    network, into = two(), numbers(2, 6)
    with network:
        node = nengo.Node(size_in=2)
        nengo.Connection(network.a.neurons, node, transform=into, synapse=None)
        nengo.Connection(node[[1, 0, 1]], network.b.neurons[:3], transform=2, synapse=FAST)
        nengo.Connection(network.a.neurons[[3, 3]], network.b.neurons[:2], synapse=SLOW)
    fast, slow = np.zeros((5, 6)), np.zeros((5, 6))
    fast[:3] = 2 * into[[1, 0, 1]]
    slow[:2, 3] = 1
    assert_edges(edges_of(network), {key(): fast, key(synapse=SLOW): slow})


@pytest.mark.parametrize("multiplied_out", [True, False])
def test_values_that_a_pass_encodes_go_to_the_dimensions(multiplied_out: bool) -> None:
    network = two(dimensions=2, radius=0.5)
    into = numbers(1, 3)
    with network:
        source, node = nengo.Node(np.ones(3)), nengo.Node(size_in=1)
        nengo.Connection(source, node, transform=into, synapse=None)
        b = network.b
        encodes = nengo.Connection(node, b.neurons, transform=b.encoders[:, 1:], synapse=FAST)
    rewrite = replace(rewrite_of(network), encoded={encodes: np.array([1])})
    folded = [node] if multiplied_out else []
    solver = ParameterSolver(rewrite, DT_S)
    edges = EdgeMatrices(rewrite, [], solver, whole(b), folded).edges
    # The values are in units of the radius; a group divides its input by its radius.
    start, values = (source, into) if multiplied_out else (node, np.ones((1, 1)))
    edge = key(EdgeSource(NO_GROUP, start), EdgeTarget("dimensions", 0))
    assert_edges(edges, {edge: 0.5 * np.vstack([np.zeros_like(values), values])})


def test_parallel_paths_add_up() -> None:
    network = two()
    with network:
        left, right = nengo.Node(size_in=2), nengo.Node(size_in=3)
        made = [
            nengo.Connection(pre, post, transform=numbers(*shape), synapse=synapse)
            for pre, post, shape, synapse in (
                (network.a.neurons, left, (2, 6), None),
                (left, right, (3, 2), None),
                (network.a.neurons, right, (3, 6), None),
                (right, network.b.neurons, (5, 3), FAST),
                (left, network.b.neurons, (5, 2), FAST),
                (network.a.neurons, network.b.neurons, (5, 6), FAST),
            )
        ]
    to_left, across, to_right, from_right, from_left, past = (c.transform.init for c in made)
    product = from_right @ (across @ to_left + to_right) + from_left @ to_left + past
    assert_edges(edges_of(network), {key(): product})


@pytest.mark.parametrize("seed", range(5))
def test_any_nodes_in_any_order_become_one_edge(seed: int) -> None:
    """Connect six nodes at random to nodes after them, and define them in another order."""
    rng = np.random.RandomState(seed)
    n, network = 6, two()
    matrix = {}
    with network:
        nodes = {i: nengo.Node(size_in=1 + i % 3) for i in rng.permutation(n)}
        row = [network.a.neurons, *(nodes[i] for i in range(n)), network.b.neurons]
        for j in rng.permutation(np.arange(1, n + 2)):
            for i in np.flatnonzero(rng.rand(j) < 0.7) if j <= n else range(n + 1):
                matrix[i, j] = rng.uniform(-1, 1, (row[j].size_in, row[i].size_out))
                synapse = FAST if j > n else None
                nengo.Connection(row[i], row[j], transform=matrix[i, j], synapse=synapse)
    reached = {0: np.eye(6)}
    for j in range(1, n + 2):
        into = [matrix[i, j] @ reached[i] for i in range(j) if (i, j) in matrix]
        reached[j] = sum(into, np.zeros((row[j].size_in, 6)))
    assert_edges(edges_of(network), {key(): reached[n + 1]})


def test_different_filters_have_separate_edges() -> None:
    network, transforms = two(), [numbers(5, 6) for _ in range(4)]
    with network:
        for transform, tau in zip(transforms, (0.005, 0.1, 0.005, None), strict=True):
            nengo.Connection(network.a.neurons, network.b.neurons, transform=transform, synapse=tau)
    expected = {
        key(): transforms[0] + transforms[2],
        key(synapse=SLOW): transforms[1],
        key(synapse=None): transforms[3],
    }
    assert_edges(edges_of(network), expected)


def test_different_filters_at_a_node_have_separate_edges() -> None:
    network = two()
    with network:
        before, after = nengo.Node(size_in=6), nengo.Node(size_in=6)
        for node, into, out in ((before, (FAST, SLOW), (None,)), (after, (None,), (FAST, SLOW))):
            for synapse in into:
                nengo.Connection(network.a.neurons, node, synapse=synapse)
            for synapse in out:
                nengo.Connection(node[:5], network.b.neurons, synapse=synapse)
    eye = 2 * np.eye(5, 6)
    assert_edges(edges_of(network), {key(): eye, key(synapse=SLOW): eye})


def test_nodes_that_stay_are_sources_and_targets_of_edges() -> None:
    network, into, out = two(), numbers(5, 2), numbers(2, 6)
    with network:
        source = nengo.Node([1, 2, 3])
        sink = nengo.Node(lambda t, x: None, size_in=4)
        nengo.Connection(source[1:], network.b.neurons, transform=into, synapse=None)
        nengo.Connection(network.a.neurons, sink[[3, 1]], transform=out, synapse=SLOW)
    expected = {
        key(EdgeSource(-1, source), synapse=None): placed(into, (5, 3), slice(None), [1, 2]),
        key(0, EdgeTarget("object", -1, sink), SLOW): placed(out, (4, 6), [3, 1], slice(None)),
    }
    assert_edges(edges_of(network), expected)


def test_a_function_of_a_node_that_stays_is_the_source_of_an_edge() -> None:
    network, into, out = two(), numbers(4, 2), numbers(5, 4)
    with network:
        source, node = nengo.Node([1, 2, 3]), nengo.Node(size_in=4)
        squares = nengo.Connection(
            source[:2], node, function=np.square, transform=into, synapse=None
        )
        nengo.Connection(node, network.b.neurons, transform=out, synapse=FAST)
    expected = {key(EdgeSource(-1, source, squares)): out @ into}
    assert_edges(edges_of(network), expected)


def test_decoded_values_of_an_ensemble_that_stays_are_the_source_of_an_edge() -> None:
    network = two(dimensions=2)
    decoded = decode_to_b(network)
    edges = matrices_of(network, whole(network.b)).edges
    target = EdgeTarget("dimensions", 0)
    assert_edges(edges, {key(EdgeSource(-1, network.a, decoded), target): np.array([[0.0], [3.0]])})


def decode_to_b(network: nengo.Network) -> nengo.Connection:
    with network:
        return decode(network.a, network.b[1], decoders(6, 1), transform=3, synapse=FAST)


def test_edges_into_a_passthrough_node_are_returned_too() -> None:
    network, into = two(), numbers(2, 6)
    with network:
        node = nengo.Node(size_in=2)
        nengo.Connection(network.a.neurons, node, transform=into, synapse=FAST)
        nengo.Connection(node, network.b, transform=np.ones((1, 2)), synapse=None)
    matrices = matrices_of(network, whole(network.a, network.b))
    assert list(matrices.into_nodes) == [node]
    assert_edges(matrices.into_nodes[node], {key(0, EdgeTarget("object", -1, node)): into})
    assert_edges(matrices.edges, {key(target=EdgeTarget("dimensions", 1)): np.ones((1, 2)) @ into})


def test_connections_between_objects_that_stay_are_not_replaced() -> None:
    with nengo.Network(seed=1) as network:
        a, b, c = ensemble("a", 3), ensemble("b", 3), ensemble("c", 3)
        source = nengo.Node([1])
        nengo.Connection(a, b)
        nengo.Connection(source, a)
        learned = nengo.Connection(a, b, learning_rule_type=nengo.PES())
        nengo.Connection(source, learned.learning_rule)
        touched = [nengo.Connection(b, c), nengo.Connection(c, source_of(network))]
    assert list(matrices_of(network, whole(c)).replaced) == touched


def source_of(network: nengo.Network) -> nengo.Node:
    with network:
        return nengo.Node(lambda t, x: None, size_in=1)


def test_different_settings_of_a_decode_path_have_separate_edges() -> None:
    network = two()
    dimension, decoded = EdgeTarget("dimensions", 1), decoders(6, 1)
    with network:
        before, behind = nengo.Node(size_in=1), nengo.Node(size_in=1)
        made = {
            decode(network.a, network.b, decoded, synapse=FAST): "auto",
            decode(network.a, network.b, decoded, synapse=FAST): "direct",
            decode(network.a, before, decoded, synapse=None): "auto",
            nengo.Connection(before, network.b, synapse=FAST): "host",
            decode(network.a, behind, decoded, synapse=None): "onoff",
            nengo.Connection(behind, network.b, synapse=FAST): "auto",
        }
    for connection, path in made.items():
        network.config[connection].decode_path = path
    paths = (None, "direct", "host", "onoff")
    assert_edges(edges_of(network), {key(target=dimension, path=path): decoded.T for path in paths})


def test_edges_of_zeros_are_dropped() -> None:
    network = two()
    with network:
        sum_is_zero = np.tile([1.0, -1.0], (5, 3))
        for transform, synapse in ((np.zeros((5, 6)), FAST), (sum_is_zero, SLOW)):
            pre, post = network.a.neurons, network.b.neurons
            nengo.Connection(pre, post, transform=transform, synapse=synapse)
    edges = edges_of(network)
    assert set(edges) == {key(synapse=SLOW)}
    assert set(without_zeros(edges)) == {key(synapse=SLOW)}


def test_ensembles_have_edges_only_to_the_ensembles_that_they_reach() -> None:
    n = 5
    with nengo.Network(seed=1) as network:
        first, second = (nengo.networks.EnsembleArray(3, n) for _ in range(2))
        nengo.Connection(first.output, second.input, synapse=FAST)
    matrices = matrices_of(network, whole(*first.ea_ensembles, *second.ea_ensembles))
    assert len(matrices.edges) == n
    assert len(matrices.into_nodes[second.input]) == n
