"""Decoders that neurons with equal encoders share, and their errors."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.tying import DecodingError, Shared, pooled, shareable, tied
from tests.helpers.small_networks import DT_S, FAST, rewrite_of

SIGNS = np.tile([[1.0], [-1.0]], (3, 1))


def pair() -> nengo.Network:
    """Return an ensemble of three neurons for each sign, decoded twice."""
    with nengo.Network(seed=5, label="pair") as network:
        spikeport.add_params(network)
        gain, bias = np.linspace(1, 2, 6), np.linspace(0.5, 1.5, 6)
        a = nengo.Ensemble(6, 1, encoders=SIGNS, gain=gain, bias=bias, label="a")
        b = nengo.Ensemble(5, 2, label="b")
        wired = nengo.Connection(a, b[1], function=np.square, transform=-2, synapse=FAST)
        network.config[wired].decode_path = "direct"
        nengo.Connection(a, b[0])
        nengo.Connection(b, a, transform=np.ones((1, 2)))
        nengo.Probe(a)
    return network


def found(network: nengo.Network) -> tuple[Rewrite, list[list[Shared]], ParameterSolver]:
    rewrite = rewrite_of(network)
    solver = ParameterSolver(rewrite, DT_S)
    return rewrite, shareable(rewrite, solver), solver


def test_neurons_of_one_sign_share_a_decoder() -> None:
    network = pair()
    _, ((one, other),), _ = found(network)
    assert (one.connection, other.connection) == tuple(network.connections[:2])
    for decoders in (one.decoders, other.decoders):
        assert decoders.shape == (6, 1)
        assert np.array_equal(decoders[SIGNS[:, 0] > 0], np.full((3, 1), decoders[0, 0]))
        assert np.array_equal(decoders[SIGNS[:, 0] < 0], np.full((3, 1), decoders[1, 0]))
        assert decoders[0, 0] != decoders[1, 0]


def test_the_error_of_shared_decoders_is_summed_over_the_evaluation_points() -> None:
    _, ((one, _),), solver = found(pair())
    built = solver.decoded(one.connection)
    points = built.eval_points
    assert one.error.values == pytest.approx(np.square(points**2).sum())
    assert one.error.own == pytest.approx(
        built.solver_info["rmses"][0] ** 2 * len(points), rel=1e-6
    )
    assert one.error.shared > one.error.own
    assert one.error.added == one.error.after - one.error.before > 0


def test_values_that_are_zero_have_no_error() -> None:
    assert DecodingError(0.0, 0.0, 0.0).before == 0
    assert DecodingError(4.0, 1.0, 4.0).added == 0.5


def test_errors_of_several_connections_add_up() -> None:
    both = pooled([DecodingError(3.0, 1.0, 2.0), DecodingError(13.0, 0.0, 2.0)])
    assert both == DecodingError(16.0, 1.0, 4.0)
    assert (both.before, both.after) == (0.25, 0.5)


def test_only_the_chosen_connection_changes() -> None:
    network = pair()
    rewrite, ((one, _),), solver = found(network)
    after = tied(rewrite, [one], solver)
    kept = [c for c in network.connections if c is not one.connection]
    new = [c for c in after.network.connections if c not in kept]
    assert [c for c in after.network.connections if c in kept] == kept
    (wired,) = new
    assert (wired.pre, wired.post, wired.synapse) == (one.connection.pre, one.connection.post, FAST)
    assert after.names[wired] == rewrite.names[one.connection]
    assert after.network.config[wired].decode_path == "direct"
    assert after.seeds[wired] == solver.seeds[one.connection]
    np.testing.assert_allclose(after.built[one.connection].weights, -2 * one.decoders.T)
    again = ParameterSolver(after, DT_S)
    np.testing.assert_allclose(again.weights(wired), -2 * one.decoders.T)
    for c in kept:
        np.testing.assert_array_equal(again.weights(c), solver.weights(c))
    assert one.connection in network.connections


def test_the_connection_to_a_learning_rule_follows_the_learned_connection() -> None:
    with nengo.Network(seed=1) as network:
        error = nengo.Node(size_in=1)
        with nengo.Network() as inner:
            pupil = nengo.Ensemble(10, 1)
            target = nengo.Node(lambda _t, x: x, size_in=1)
            taught = nengo.Connection(pupil, target, learning_rule_type=nengo.PES())
        units = nengo.Ensemble(4, 1, encoders=np.ones((4, 1)))
        nengo.Connection(units, target)
        late = nengo.Connection(error, taught.learning_rule)
    rewrite, ((one,),), solver = found(network)
    assert inner.connections == [taught]
    assert network.all_connections.index(late) < network.all_connections.index(taught)
    order = tied(rewrite, [one], solver).network.connections
    assert order.index(taught) < order.index(late)
