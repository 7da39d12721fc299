import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network


def wired(transform: np.ndarray, path: str) -> ChipImage:
    """Return neurons wired to neurons, with and without ballast."""
    with nengo.Network(seed=5, label="wired") as network:
        spikeport.add_params(network)
        one = {"gain": nengo.dists.Choice([1.0]), "radius": 1.0}
        pre = nengo.Ensemble(12, 1, bias=np.linspace(1, 4, 12), label="pre", **one)
        post = nengo.Ensemble(9, 1, bias=np.linspace(0.5, 1.5, 9), label="post", **one)
        wire = nengo.Connection(pre.neurons, post.neurons, transform=transform, synapse=0.005)
        network.config[wire].decode_path = path
        nengo.Probe(post.neurons)
    return compile_network(network, pipeline="").image


def outputs(image: ChipImage) -> np.ndarray:
    chip = NativeChip(image, seed=0)
    return np.array([chip.step(np.array([]), {})[0].copy() for _ in range(200)])


TIED = np.repeat(np.random.RandomState(1).uniform(-0.2, 1, (9, 4)), 3, axis=1) / 300
SPARSE = np.eye(9, 12) / 100


@pytest.mark.parametrize(("transform", "axons", "weights"), [(TIED, 4, 36), (SPARSE, 9, 9)])
def test_the_same_with_less(transform: np.ndarray, axons: int, weights: int) -> None:
    before, after = (wired(transform, path) for path in ("auto", "direct"))
    assert len(before.in_axons.row) == 12
    assert len(after.in_axons.row) == axons
    assert len(after.synapses.weight) == weights
    assert outputs(before).sum() > 0
    np.testing.assert_array_equal(outputs(before), outputs(after))
