"""Parameters of ensembles and connections, as Nengo or nengo-loihi builds them."""

import nengo
import nengo_loihi
import numpy as np
import pytest
import scipy.sparse as sparse

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.solver import (
    CHIP,
    FLOAT,
    Builder,
    ParameterSolver,
    full,
    nengo_transform,
    transformed,
)

DT_S = 0.001


def make() -> nengo.Network:
    with nengo.Network(seed=2) as network:
        network.a = nengo.Ensemble(30, 2, radius=0.5)
        network.node = nengo.Node([1, 2, 3])
        network.squares = nengo.Connection(
            network.a,
            nengo.Ensemble(20, 1),
            function=lambda x: x[0] ** 2,
            transform=nengo.dists.Uniform(1, 2),
        )
    return network


def solver_of(network: nengo.Network, builder: Builder | None = None) -> ParameterSolver:
    return ParameterSolver(Rewrite(network, Names(network)), DT_S, builder)


def test_float_parameters_equal_those_that_nengo_builds() -> None:
    network = make()
    network.squares.transform = 3
    solver = solver_of(network, FLOAT)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        built, decoded = simulator.data[network.a], simulator.data[network.squares]
    for name in ("gain", "bias", "encoders"):
        found = getattr(solver.ensemble(network.a), name)
        np.testing.assert_array_equal(found, getattr(built, name))
    np.testing.assert_array_equal(solver.weights(network.squares), decoded.weights)


def test_chip_parameters_equal_those_that_nengo_loihi_builds() -> None:
    network = make()
    network.squares.transform = 3
    solver = solver_of(network)
    with (
        numpy1_semantics(),
        nengo_loihi.Simulator(network, progress_bar=False, target="sim") as simulator,
    ):
        built, decoded = simulator.data[network.a], simulator.data[network.squares]
    np.testing.assert_array_equal(solver.ensemble(network.a).gain, built.gain)
    per_spike = decoded.weights * DT_S  # nengo-loihi's are for spikes of height 1
    np.testing.assert_allclose(solver.weights(network.squares), per_spike, rtol=1e-12)


def test_decoders_for_the_chip_differ_from_float_decoders() -> None:
    network = make()
    weights = [solver_of(network, one).weights(network.squares) for one in (CHIP, FLOAT)]
    assert weights[0].shape == weights[1].shape == (1, 30)
    assert not np.allclose(*weights)


@pytest.mark.parametrize("builder", [CHIP, FLOAT])
def test_transforms_are_sampled_once(builder: Builder) -> None:
    network = make()
    solver = solver_of(network, builder)
    transform = solver.transform(network.squares)
    assert 1 < transform < 2
    np.testing.assert_array_equal(solver.decoded(network.squares).transform, transform)
    np.testing.assert_array_equal(solver.built(network.squares).transform, transform)


def test_each_object_is_solved_once() -> None:
    network = make()
    solver = solver_of(network)
    assert solver.decoded(network.squares) is solver.decoded(network.squares)
    assert solver.ensemble(network.a) is solver.ensemble(network.a)


def test_weights_of_a_slice_of_a_node_select_its_entries() -> None:
    network = make()
    with network:
        picked = nengo.Connection(network.node[[2, 0, 2]], nengo.Node(size_in=3), transform=5)
    expected = [[0, 0, 5], [5, 0, 0], [0, 0, 5]]
    np.testing.assert_array_equal(solver_of(network).weights(picked), expected)


def test_weights_of_a_connection_from_a_node_are_its_transform() -> None:
    network = make()
    with network:
        connection = nengo.Connection(network.node, nengo.Node(size_in=3), transform=5)
    built = solver_of(network).built(connection)
    assert built.weights == built.transform == 5
    assert built.solver_info is None


def test_neurons_start_at_the_voltages_of_nengo() -> None:
    with nengo.Network(seed=2) as network:
        kind = nengo.LIF(initial_state={"voltage": nengo.dists.Uniform(0, 1)})
        a = nengo.Ensemble(5, 1, neuron_type=kind)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        started = simulator.signals[simulator.model.sig[a.neurons]["voltage"]]
        found = solver_of(network).initial_state(a)["voltage"]
        np.testing.assert_array_equal(found, started)


def test_a_transform_that_is_not_finite_is_refused() -> None:
    network = make()
    network.squares.transform = np.inf
    with pytest.raises(RefusedError, match="SP011"):
        solver_of(network).weights(network.squares)


def test_a_refusal_by_the_builder_names_the_ensemble() -> None:
    network = make()
    network.a.label = "odd"
    network.a.gain = np.ones(30)
    with pytest.raises(RefusedError, match=r"^odd: Nengo refuses it: gain or bias"):
        solver_of(network).ensemble(network.a)


MATRIX = np.arange(6.0).reshape(2, 3)


@pytest.mark.parametrize("matrix", [MATRIX, sparse.csr_array(MATRIX)])
@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        (np.array(2.0), 2 * MATRIX),
        (np.array([2.0, 3.0]), [[0, 2, 4], [9, 12, 15]]),
        (np.array([[1.0, 1.0]]), [[3, 5, 7]]),
    ],
)
def test_a_transform_is_multiplied_with_a_matrix(
    matrix: object, transform: np.ndarray, expected: np.ndarray
) -> None:
    found = transformed(transform, matrix)
    dense = found.toarray() if sparse.issparse(found) else found
    np.testing.assert_array_equal(dense, expected)


def test_scalar_and_vector_transforms_become_matrices() -> None:
    np.testing.assert_array_equal(full(np.array(2.0), 2), [[2, 0], [0, 2]])
    np.testing.assert_array_equal(full(np.array([2.0, 3.0]), 2), [[2, 0], [0, 3]])
    np.testing.assert_array_equal(full(MATRIX, 3), MATRIX)
    np.testing.assert_array_equal(full(sparse.csr_array(MATRIX), 3), MATRIX)


@pytest.mark.parametrize(("n_zeros", "is_sparse"), [(4, False), (5, True), (6, True), (10, False)])
def test_matrices_become_sparse_if_half_or_more_but_not_all_entries_are_zero(
    n_zeros: int, is_sparse: bool
) -> None:
    matrix = np.ones(10)
    matrix[:n_zeros] = 0
    found = nengo_transform(sparse.csr_array(matrix.reshape(2, 5)))
    assert isinstance(found, nengo.Sparse) == is_sparse
    dense = found.sample().toarray() if is_sparse else found
    np.testing.assert_array_equal(dense, matrix.reshape(2, 5))
