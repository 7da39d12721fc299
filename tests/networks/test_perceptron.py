"""Networks of perceptrons, with the functions around their layers on the host."""

from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.errors import UsageError
from spikeport.networks.loading.chain import Chain
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.perceptron import options_for, perceptron
from spikeport.networks.policy import Layer, PolicyOptions, exact


@pytest.fixture
def bounded() -> Mlp:
    """Return layers with a clipped observation, and tanh and a clip of their action."""
    rng = np.random.RandomState(0)
    chain = Chain().clipped(-1, 1).dense(rng.normal(size=(6, 2))).activated("relu")
    last = chain.dense(0.15 * rng.normal(size=(3, 6)))
    return (2.0 * last.activated("tanh")).clipped(-1.5, 1).mlp()


@pytest.mark.parametrize("backend", ["reference", "native"])
def test_the_host_clips_the_observation_and_squashes_the_action(bounded: Mlp, backend: str) -> None:
    observations = np.random.RandomState(1).uniform(-1.5, 1.5, (200, 2))
    with nengo.Network(seed=0) as network:
        net = perceptron(bounded, observations, PolicyOptions(40))
        seen = nengo.Node([3.0, -0.2])  # as (1.0, -0.2)
        nengo.Connection(seen, net.observation, synapse=None)
        action = nengo.Probe(net.action)
    with Simulator(network, backend=backend) as sim:
        sim.run(0.2)
    found, wanted = sim.data[action][100:], bounded.exact(np.array([3.0, -0.2]))[-1]
    assert found.min() >= -1.5
    assert found.max() <= 1
    np.testing.assert_allclose(found.mean(axis=0), wanted, atol=0.1)
    # Actions without the clip of the observation, or without tanh, are elsewhere.
    layers, squash = bounded.layers, bounded.squash
    unclipped = squash(exact(layers, np.array([3.0, -0.2]), "relu")[-1])
    linear = replace(squash, tanh=False)(exact(layers, np.array([1.0, -0.2]), "relu")[-1])
    assert min(np.abs(other - wanted).max() for other in (unclipped, linear)) > 0.15


def test_without_ends_the_network_is_the_policy_alone() -> None:
    mlp = Chain().dense(np.eye(2)).activated("elu").dense(np.eye(2)).mlp()
    net = perceptron(mlp, np.random.RandomState(0).normal(size=(50, 2)))
    assert net.observation.output is None
    assert [node.label for node in net.nodes if node.size_in] == ["observation", "action"]
    assert len(net.layers[0].halves) == 4  # two units, and elu has neurons below zero


def test_observations_of_another_size_are_refused(bounded: Mlp) -> None:
    with pytest.raises(UsageError, match=r"observations of shape \(5, 3\), expected \(m, 2\)"):
        perceptron(bounded, np.zeros((5, 3)))


@pytest.mark.parametrize(
    ("activation", "units"),
    [("elu", "hybrid"), ("relu", "hybrid"), ("tanh", "bent"), ("silu", "bent"), ("gelu", "bent")],
)
def test_units_are_those_that_compute_the_activation_best(activation: str, units: str) -> None:
    mlp = Mlp(
        (Layer(np.ones((3, 2)), np.zeros(3)), Layer(np.ones((1, 3)), np.zeros(1))), activation
    )
    options = options_for(mlp, 6)
    assert (options.units, options.activation, options.n_neurons) == (units, activation, 6)
    net = perceptron(mlp, np.zeros((5, 2)))
    parts = {
        np.unique(np.round(one.intercepts, 3)).size
        for one in net.layers[0].all_ensembles
        if isinstance(one.intercepts, np.ndarray)
    }
    assert parts == ({2} if units == "bent" else set())
