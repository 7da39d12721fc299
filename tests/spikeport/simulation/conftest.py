"""A small network, and its run."""

import nengo
import numpy as np
import pytest

from spikeport.simulation.run import SimulationOptions, run


def small(stimulus=lambda t: np.sin(40 * t)) -> nengo.Network:
    with nengo.Network(seed=1) as net:
        node = nengo.Node(stimulus, size_out=1, label="stimulus")
        ensemble = nengo.Ensemble(40, 1, label="a")
        nengo.Connection(node, ensemble)
        nengo.Probe(ensemble, synapse=0.01, label="costs $ and/or $")
        nengo.Probe(ensemble.neurons)
        nengo.Probe(ensemble, sample_every=0.01, label="time_1_s")
        nengo.Probe(node)
    return net


@pytest.fixture(scope="package")
def ran():
    return run(small(), SimulationOptions(steps=100))


@pytest.fixture
def network():
    return small
