"""Small networks for the chip, their integer blocks and images."""

import nengo
import numpy as np

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.pipeline import compile_network


def recurrent() -> nengo.Network:
    """Return a network with a loop, full weights, slices, and neurons wired to neurons."""
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


def neurons(label: str, bias: list[float]) -> nengo.Ensemble:
    """Return neurons of gain 1 and these biases."""
    gain = np.ones(len(bias))
    return nengo.Ensemble(len(bias), 1, label=label, gain=gain, bias=bias)


def wired(weights: list[list[float]], bias: list[float]) -> ChipImage:
    """Return the image of two neurons that always spike, wired to a neuron for each bias."""
    with nengo.Network(seed=1) as network:
        pre, post = neurons("pre", [3.0, 4.0]), neurons("post", bias)
        nengo.Connection(pre.neurons, post.neurons, transform=weights, synapse=0.005)
    return compile_network(network, pipeline="").image
