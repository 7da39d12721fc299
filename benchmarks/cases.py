"""The networks whose speed is measured, and networks that several benchmarks build."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import nengo
import numpy as np
import scipy.sparse


class Case(NamedTuple):
    """A network, and the title of its row."""

    title: str
    make: Callable[[], nengo.Network]


def chain(n: int, n_neurons: int, seed: int | None = None) -> nengo.Network:
    """Return n ensembles, each decoded into the next; with a seed, all are equal."""
    with nengo.Network(seed=0) as network:
        stimulus = nengo.Node(lambda t: np.sin(t))
        ensembles = [nengo.Ensemble(n_neurons, 1, seed=seed) for _ in range(n)]
        for pre, post in zip([stimulus, *ensembles], ensembles, strict=False):
            nengo.Connection(pre, post, seed=seed)
        nengo.Probe(ensembles[-1], synapse=0.01)
    return network


def scattered(
    rng: np.random.RandomState, n: int, fan_out: int, low: float, high: float
) -> nengo.Sparse:
    """Return weights from each of n neurons to some random ones, uniform between two bounds."""
    targets = np.concatenate([rng.choice(n, fan_out, replace=False) for _ in range(n)])
    weights = rng.uniform(low, high, len(targets))
    sources = np.repeat(np.arange(n), fan_out)
    return nengo.Sparse((n, n), init=scipy.sparse.csr_matrix((weights, (targets, sources)), (n, n)))


def arm_like() -> nengo.Network:
    """Return two ensembles of 4,000 LIF neurons in a loop with the host."""
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
    """Return three layers of LIF neurons, fully connected by random weights."""
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
    """Return basal ganglia and thalamus, which choose one of three actions."""
    with nengo.Network(seed=0) as network:
        utility = nengo.Node(lambda t: [0.8, 0.4, 0.4] if t % 1 < 0.5 else [0.4, 0.8, 0.4])
        ganglia, thalamus = nengo.networks.BasalGanglia(3), nengo.networks.Thalamus(3)
        chosen = nengo.Node(lambda _t, x: x, size_in=3)
        nengo.Connection(utility, ganglia.input, synapse=None)
        nengo.Connection(ganglia.output, thalamus.input)
        nengo.Connection(thalamus.output, chosen)
    return network


def channel() -> nengo.Network:
    """Return a communication channel of 1,000 neurons that learns by PES."""
    with nengo.Network(seed=0) as network:
        stimulus = nengo.Node(lambda t: [np.sin(5 * t), np.cos(3 * t)])
        pre = nengo.Ensemble(1000, 2, label="pre")
        post = nengo.Node(size_in=2)
        error = nengo.Node(size_in=2)
        nengo.Connection(stimulus, pre)
        taught = nengo.Connection(
            pre, post, function=lambda x: [0, 0], learning_rule_type=nengo.PES(1e-4)
        )
        nengo.Connection(post, error)
        nengo.Connection(stimulus, error, transform=-1)
        nengo.Connection(error, taught.learning_rule)
        nengo.Probe(post, synapse=0.02)
    return network


def adaptive() -> nengo.Network:
    """Return adaptive control of a motor under a load: 1,000 neurons learn to correct a PD law."""
    motor = np.zeros(2)

    def advance(t: float, torque: np.ndarray) -> np.ndarray:
        load = 2 * np.sin(motor[0]) + 0.5
        motor[1] += 0.001 * (torque[0] - load - 0.1 * motor[1])
        motor[0] += 0.001 * motor[1]
        return np.append(motor, np.sin(2 * t))

    with nengo.Network(seed=0) as network:
        plant = nengo.Node(advance, size_in=1, size_out=3)
        law = nengo.Node(lambda _t, x: 20 * (x[2] - x[0]) - 5 * x[1], size_in=3, size_out=1)
        adapts = nengo.Ensemble(1000, 2, radius=2, label="adapts")
        correction = nengo.Node(size_in=1)
        nengo.Connection(plant, law, synapse=None)
        nengo.Connection(law, plant, synapse=0.001)
        nengo.Connection(plant[:2], adapts)
        taught = nengo.Connection(
            adapts, correction, function=lambda _x: [0], learning_rule_type=nengo.PES(1e-4)
        )
        nengo.Connection(correction, plant, synapse=0.005)
        nengo.Connection(law, taught.learning_rule, transform=-0.05)
    return network


def critic() -> nengo.Network:
    """Return a critic of 500 neurons that learns values by temporal differences."""
    with nengo.Network(seed=0) as network:
        place = nengo.Node(lambda t: [np.cos(2 * t), np.sin(2 * t)])
        reward = nengo.Node(lambda t: float(np.cos(2 * t) > 0.95))
        state = nengo.Ensemble(500, 2, label="state")
        value = nengo.Node(size_in=1)
        difference = nengo.Node(size_in=1)
        nengo.Connection(place, state)
        taught = nengo.Connection(
            state, value, function=lambda _x: [0], learning_rule_type=nengo.PES(1e-4)
        )
        nengo.Connection(reward, difference, transform=-1)
        nengo.Connection(value, difference, transform=-0.9, synapse=0.005)
        nengo.Connection(value, difference, synapse=0.05)
        nengo.Connection(difference, taught.learning_rule)
    return network


NETWORKS = {
    "arm_like": Case("8,000 LIF neurons, closed loop", arm_like),
    "layers": Case("3 layers of 2,560 LIF neurons, 13.6 million weights", layers),
    "basal_ganglia": Case("Basal ganglia and thalamus, 3 actions", basal_ganglia),
}
LEARNING = {make.__name__: make for make in (channel, adaptive, critic)}
