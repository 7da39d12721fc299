from collections.abc import Callable

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import Compilation, compile_network


def make_chain(seed: int | None = 3) -> nengo.Network:
    with nengo.Network(label="chain", seed=seed) as network:
        stimulus = nengo.Node(0.5, label="stimulus")
        first = nengo.Ensemble(12, 1, label="first")
        second = nengo.Ensemble(10, 2, label="second")
        nengo.Connection(stimulus, first)
        nengo.Connection(first, second, transform=[[1.0], [-0.5]])
        nengo.Probe(second, synapse=0.01, label="decoded")
        nengo.Probe(first.neurons[2:7], "voltage", label="voltage")
    return network


def make_convolution(pop_type: int = 32, split: bool = True) -> nengo.Network:
    """Return a network of 4 x 4 pixels, through 4 filters of 3 x 3, onto 2 x 2 x 4 neurons."""
    kernel = np.random.RandomState(1).uniform(-1, 1, (3, 3, 1, 4))
    filters = nengo.Convolution(4, (4, 4, 1), kernel_size=(3, 3), init=kernel)
    with nengo.Network(label="convolution", seed=4) as network:
        nengo_loihi.add_params(network)
        image = nengo.Ensemble(
            16, 1, label="image", gain=nengo.dists.Choice([1.0]), bias=np.linspace(0, 3, 16)
        )
        maps = nengo.Ensemble(
            16,
            1,
            label="maps",
            gain=nengo.dists.Choice([0.01]),
            bias=nengo.dists.Choice([0.5]),
        )
        edge = nengo.Connection(image.neurons, maps.neurons, transform=filters, synapse=0.005)
        network.config[edge].pop_type = pop_type
        if split:
            network.config[maps].block_shape = nengo_loihi.BlockShape((2, 1, 4), (2, 2, 4))
        nengo.Probe(maps.neurons, label="maps")
    return network


def make_neuron_network(
    transform: object, n_pre: int, n_post: int, pre_slice: slice = slice(None)
) -> nengo.Network:
    """Return ``n_pre`` neurons wired straight to ``n_post`` neurons, and nothing else."""
    with nengo.Network(seed=5) as network:
        one = {"gain": nengo.dists.Choice([1.0]), "bias": nengo.dists.Choice([1.0])}
        pre = nengo.Ensemble(n_pre, 1, label="pre", **one)
        post = nengo.Ensemble(n_post, 1, label="post", **one)
        nengo.Connection(pre.neurons[pre_slice], post.neurons, transform=transform, synapse=0.005)
    return network


@pytest.fixture(scope="session")
def chain() -> Callable[..., nengo.Network]:
    return make_chain


@pytest.fixture(scope="session")
def convolution() -> Callable[..., nengo.Network]:
    return make_convolution


@pytest.fixture(scope="session")
def neuron_network() -> Callable[..., nengo.Network]:
    return make_neuron_network


@pytest.fixture(scope="session")
def compiled_chain() -> Compilation:
    """Return an image with one block a core."""
    return compile_network(make_chain(), pipeline="")


@pytest.fixture(scope="session")
def compiled_convolution() -> Compilation:
    """Return an image with one block a core."""
    return compile_network(make_convolution(), pipeline="")


@pytest.fixture
def image(compiled_chain: Compilation) -> ChipImage:
    return compiled_chain.image
