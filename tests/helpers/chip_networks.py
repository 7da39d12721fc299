"""Networks that reach much of nengo-loihi's builder, and their integer blocks."""

import nengo
import numpy as np

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise


def recurrent() -> nengo.Network:
    """A loop, weights solved in full, slices, and neurons wired to neurons."""
    with nengo.Network(seed=8) as network:
        a = nengo.Ensemble(30, 2, radius=1.3, label="a")
        b = nengo.Ensemble(20, 1, neuron_type=nengo.SpikingRectifiedLinear(), label="b")
        nengo.Connection(a, a, synapse=0.1, function=lambda x: x**2)
        nengo.Connection(a[0], b, solver=nengo.solvers.LstsqL2(weights=True))
        nengo.Connection(b.neurons[3:9], a.neurons, transform=np.eye(30, 6) * 1e-3)
        nengo.Probe(b)
    return network


def integer_blocks(network: nengo.Network) -> IntegerBlocks:
    """Build a network and discretise it, without lint and passes."""
    return discretise(build(Rewrite(network, Names(network)), dt_s=0.001))
