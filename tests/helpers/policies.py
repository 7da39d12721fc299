"""Small policies, and the error of their spiking versions."""

import dataclasses
from pathlib import Path

import nengo
import numpy as np

from spikeport.networks import walking_policy
from spikeport.networks.policy import Layer, exact, policy, record_ranges

STEPS = 40
"""Steps for which an observation is held; actions of the second half are averaged."""
SIZES = ((6, 10), (10, 10), (10, 4))
RNG = np.random.RandomState(0)
LAYERS = [Layer(RNG.randn(n, m) * 1.2 / np.sqrt(m), 0.2 * RNG.randn(n)) for m, n in SIZES]
OBSERVATIONS = RNG.randn(600, 6)


def save_pocket(path: Path) -> Path:
    """Save the shipped policy with 8 units in each hidden layer; it stands, and walks nowhere."""
    shipped, n = walking_policy.load(), 8
    first, second, third, last = shipped.weights
    weights = (first[:n], second[:n, :n], third[:n, :n], 0.1 * last[:, :n])
    biases = (*(b[:n] for b in shipped.biases[:-1]), np.zeros(len(last)))
    dataclasses.replace(shipped, weights=weights, biases=biases).save(path)
    return path


def built(options, **more):
    """Make the spiking policy with some options."""
    ranges = record_ranges(LAYERS, OBSERVATIONS, activation_name=options.activation)
    return policy(LAYERS, ranges, options, seed=3, **more)


def float_error(options, **more):
    """Return the rms error of mean actions in float, relative to the exact actions' deviation."""
    shown = OBSERVATIONS[:30]
    with nengo.Network(seed=1) as network:
        net = built(options, **more)
        held = nengo.Node(nengo.processes.PresentInput(shown, STEPS * 1e-3))
        nengo.Connection(held, net.observation, synapse=None)
        probe = nengo.Probe(net.action)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(STEPS * len(shown), progress_bar=False)
        found = sim.data[probe].reshape(len(shown), STEPS, -1)[:, STEPS // 2 :].mean(axis=1)
    wanted = exact(LAYERS, shown, options.activation)[-1]
    return np.sqrt(np.mean((found - wanted) ** 2) / np.var(wanted))
