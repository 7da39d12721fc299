"""An interrupt in a long run leaves the data up to that step readable."""

import os
import signal
from itertools import pairwise

import nengo
import numpy as np
import pytest

import spikeport

LAST_STEP = 37


def interrupted_network() -> tuple[nengo.Network, list[nengo.Probe]]:
    """A network that sends the process SIGINT, as Ctrl-C does, and its probes."""

    def source(t: float) -> float:
        if round(t / 0.001) == LAST_STEP + 1:
            os.kill(os.getpid(), signal.SIGINT)
        return np.sin(20 * t)

    with nengo.Network(seed=0) as network:
        node = nengo.Node(source)
        ensemble = nengo.Ensemble(20, 1)
        host = nengo.Node(lambda _t, x: x, size_in=1)
        nengo.Connection(node, ensemble)
        nengo.Connection(ensemble, host)
        probes = [nengo.Probe(obj) for obj in (node, ensemble, ensemble.neurons, host)]
    return network, probes


pytestmark = pytest.mark.usefixtures("interruptible")


@pytest.mark.parametrize("backend", ["native", "nengo-loihi", "reference"])
def test_data_up_to_the_interrupt_is_readable(backend: str) -> None:
    network, probes = interrupted_network()
    with spikeport.Simulator(network, backend=backend) as sim:
        with pytest.raises(KeyboardInterrupt):
            sim.run_steps(100)
        assert sim.n_steps == LAST_STEP
        assert [len(sim.data[probe]) for probe in probes] == [LAST_STEP] * len(probes)
        assert len(sim.trange()) == LAST_STEP
        assert sim.activity.n_steps == LAST_STEP
    assert all(len(sim.data[probe]) == LAST_STEP for probe in probes)  # closed, too
    assert all(np.any(a != b) for a, b in pairwise(sim.data[probes[0]]))
