"""The networks whose speed is measured."""

import itertools

import nengo
import numpy as np


def arm_like() -> nengo.Network:
    """8,000 LIF neurons, closed loop."""
    with nengo.Network(seed=0) as network:
        state = nengo.Node(lambda t, x: np.append(0.5 * np.sin(5 * t) - 0.1 * x, 0.3), size_in=4)
        torque = nengo.Node(lambda _t, x: x, size_in=4)
        nengo.Connection(torque, state, synapse=None)
        for _ in range(2):
            ensemble = nengo.Ensemble(
                4000,
                5,
                max_rates=nengo.dists.Uniform(200, 400),
                intercepts=nengo.dists.Uniform(-1, 0.9),
                n_eval_points=2000,
            )
            nengo.Connection(state, ensemble, synapse=None)
            nengo.Connection(ensemble, torque, function=lambda x: 0.5 * x[:4], synapse=0.01)
    return network


def layers() -> nengo.Network:
    """3 layers of 2,560 LIF neurons, 13.6 million weights."""
    n, n_inputs, n_outputs, rng = 2560, 96, 12, np.random.RandomState(0)
    with nengo.Network(seed=0) as network:
        observation = nengo.Node(lambda t: np.sin(5 * t + np.arange(n_inputs)))
        action = nengo.Node(lambda _t, x: x, size_in=n_outputs)
        stack = [
            nengo.Ensemble(n, 1, gain=np.ones(n), bias=rng.uniform(1.2, 3, n)).neurons
            for _ in range(3)
        ]
        nengo.Connection(observation, stack[0], transform=0.1 * rng.randn(n, n_inputs))
        for pre, post in itertools.pairwise(stack):
            nengo.Connection(pre, post, transform=1e-4 * rng.randn(n, n))
        nengo.Connection(stack[-1], action, transform=1e-3 * rng.randn(n_outputs, n), synapse=0.01)
    return network


def basal_ganglia() -> nengo.Network:
    """Basal ganglia and thalamus, 3 actions."""
    with nengo.Network(seed=0) as network:
        utility = nengo.Node(lambda t: [0.8, 0.4, 0.4] if t % 1 < 0.5 else [0.4, 0.8, 0.4])
        ganglia, thalamus = nengo.networks.BasalGanglia(3), nengo.networks.Thalamus(3)
        chosen = nengo.Node(lambda _t, x: x, size_in=3)
        nengo.Connection(utility, ganglia.input, synapse=None)
        nengo.Connection(ganglia.output, thalamus.input)
        nengo.Connection(thalamus.output, chosen)
    return network


NETWORKS = {make.__name__: make for make in (arm_like, layers, basal_ganglia)}
