"""Decoders and read-outs of a policy, solved for together."""

import nengo
import numpy as np
import pytest

from spikeport.networks.policy import (
    Calibrated,
    Layer,
    PolicyOptions,
)
from spikeport.networks.policy_solving import by_halves, refit
from tests.helpers.policies import LAYERS, OBSERVATIONS, built, float_error


@pytest.mark.slow
def test_a_policy_solved_by_layers_errs_less_than_one_solved_by_units():
    unit = float_error(PolicyOptions(units="lif"))
    layer = float_error(PolicyOptions(units="lif", solve="layer"), observations=OBSERVATIONS)
    assert layer < 0.7 * unit


@pytest.mark.slow
def test_solving_by_layers_leaves_neurons_and_decoders_of_units_unchanged():
    unit, layer = (
        built(PolicyOptions(solve=solve), observations=OBSERVATIONS) for solve in ("unit", "layer")
    )
    with (
        nengo.Simulator(unit, progress_bar=False) as a,
        nengo.Simulator(layer, progress_bar=False) as b,
    ):
        for one, other in zip(unit.layers[1].halves, layer.layers[1].halves, strict=True):
            assert (a.data[one.ensemble].gain == b.data[other.ensemble].gain).all()
            assert (a.data[one.decoded].weights == b.data[other.decoded].weights).all()


def test_solving_by_layers_adds_no_second_policy_to_a_network_under_construction():
    with nengo.Network() as network:
        net = built(PolicyOptions(solve="layer"), observations=OBSERVATIONS)
    assert network.networks == [net]


@pytest.mark.slow
def test_a_readout_by_halves_computes_the_same_as_the_layer():
    options = PolicyOptions()
    actions = []
    last = by_halves(LAYERS[-1], options)
    for calibrated in (None, Calibrated(last.weights, last.bias)):
        with nengo.Network(seed=1) as network:
            net = built(options, calibrated=calibrated)
            held = nengo.Node(OBSERVATIONS[0])
            nengo.Connection(held, net.observation, synapse=None)
            probe = nengo.Probe(net.action)
        with nengo.Simulator(network, progress_bar=False) as sim:
            sim.run_steps(50, progress_bar=False)
            actions.append(sim.data[probe])
    np.testing.assert_allclose(*actions, atol=1e-12)


def test_a_refit_finds_the_weights_that_values_were_made_with():
    rng = np.random.RandomState(2)
    halves, weights, bias = rng.rand(4000, 6), rng.randn(2, 6), rng.randn(2)
    nominal = by_halves(Layer(np.zeros((2, 3)), np.zeros(2)), PolicyOptions())
    found = refit(nominal, halves, halves @ weights.T + bias)
    np.testing.assert_allclose(found.weights, weights, rtol=0.01, atol=0.01)
    np.testing.assert_allclose(found.bias, bias, atol=0.01)


def test_a_refit_keeps_the_weights_of_halves_that_are_always_zero():
    halves = np.random.RandomState(2).rand(100, 6)
    halves[:, 4] = 0.0
    nominal = by_halves(Layer(np.array([[1.0, 2.0, 3.0]]), np.zeros(1)), PolicyOptions())
    found = refit(nominal, halves, halves.sum(axis=1, keepdims=True))
    assert found.weights[0, 4] == 2.0
    assert abs(found.weights[0, 3] - 1.0) < 0.05
