import warnings
from collections.abc import Callable
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.loihi.numpy1 import numpy1_semantics


def reference_simulator(network: nengo.Network, seed: int = 5) -> Any:
    """Return nengo-loihi's own simulator, in lock-step, on the arithmetic of NumPy 1."""
    with warnings.catch_warnings(), numpy1_semantics():
        warnings.simplefilter("ignore")
        return nengo_loihi.Simulator(network, precompute=False, seed=seed, target="sim")


@pytest.fixture(scope="session")
def nengo_loihi_simulator() -> Callable[..., Any]:
    return reference_simulator


@pytest.fixture
def loop() -> nengo.Network:
    """Return a network of two ensembles, with a loop through the host and a probe of each kind."""
    with nengo.Network(seed=1) as network:
        u = nengo.Node(lambda t: np.sin(20 * t), label="u")
        a = nengo.Ensemble(40, 1, label="a")
        b = nengo.Ensemble(30, 1, label="b")
        gain = nengo.Node(lambda _t, x: -0.5 * x, size_in=1, label="gain")
        nengo.Connection(u, a)
        nengo.Connection(a, b)
        nengo.Connection(b, gain)
        nengo.Connection(gain, a)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(a.neurons)
        nengo.Probe(gain)
    return network
