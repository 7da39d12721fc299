"""Neurons that are copies of others, and neurons that cannot fire."""

from collections.abc import Callable
from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.drive import duplicated, silenced
from spikeport.compile.check.hints import image_hints
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import Encoding
from spikeport.compile.pipeline import compile_network
from tests.helpers.chip_networks import neurons, wired
from tests.helpers.images import Block, Group, Output, Parts, Route


def hints(image: ChipImage, *errors: BlockError) -> list[str]:
    return [str(hint) for hint in image_hints(image, errors)]


def test_copies_have_the_same_weights_bias_and_settings() -> None:
    image = wired([[1, 2], [2, 1], [1, 2], [1, 2]], [1.0, 1.0, 1.0, 2.0])
    assert duplicated(image).tolist() == [False, False, False, False, True, False]
    assert hints(image) == [
        "post: SP404 duplicated neurons: 1 of 4; cure: draw encoders, gains and biases at random, "
        "or use fewer neurons"
    ]


def test_copies_spike_together() -> None:
    chip = NativeChip(wired([[1, 2], [1, 2]], [0.5, 0.5]), seed=0)
    for _ in range(100):
        chip.step(np.array([]), {})
        assert chip.state.v[2] == chip.state.v[3]
    assert chip.activity().totals()["spikes"] > 0


def test_equal_neurons_of_different_blocks_are_not_copies() -> None:
    with nengo.Network(seed=1) as network:
        neurons("a", [1.5])
        neurons("b", [1.5])
    assert not duplicated(compile_network(network).image).any()


def test_neurons_that_cannot_reach_threshold_are_silenced() -> None:
    # A LIF neuron fires at a current of more than 1.
    image = wired([[0, 0], [-1, 0], [0, 0], [1, 0]], [0.9, 0.9, 1.1, 0.9])
    assert silenced(image).tolist() == [False, False, True, True, False, False]
    assert [text for text in hints(image) if "SP405" in text] == [
        "post: SP405 silenced neurons: 2 of 4; cure: lower their intercepts or raise their gain, "
        "or use fewer neurons"
    ]


def test_neurons_that_events_of_a_file_excite_are_not_silenced() -> None:
    """Several events of a pixel in a step add up, unlike spikes of values in a step."""
    group = Group([[64, -64, 0]], [[[0, 1, 2]]])
    image = Parts([Block(3, vth=6400, decay_v=4095)], [group], [1], [Route([0], input=0)]).image()
    chip = NativeChip(image, seed=0)
    chip.step(np.zeros(200, dtype=int), {})
    chip.step(np.array([], dtype=int), {})
    assert chip.state.spiked.tolist() == [1, 0, 0]
    assert silenced(image).tolist() == [False, True, True]
    (entry,) = image.manifest.inputs
    values = replace(entry, encoding=Encoding("on_off", 500.0, 500.0))
    of_values = replace(image, manifest=replace(image.manifest, inputs=(values,)))
    assert silenced(of_values).all()


def test_read_outs_are_neither_copies_nor_silenced() -> None:
    reads = [Output("voltage", [0, 1], decoded=True)]
    image = Parts([Block(2), Block(2)], outputs=reads).image()
    assert duplicated(image).tolist() == [False, False, False, True]
    assert silenced(image).tolist() == [False, False, True, True]


@pytest.mark.parametrize("seed", range(3))
def test_silenced_neurons_never_spike(seed: int) -> None:
    rng = np.random.RandomState(seed)
    image = wired(rng.uniform(-0.02, 0.02, (40, 2)).tolist(), rng.uniform(0.5, 1.1, 40).tolist())
    chip, spiked = NativeChip(image, seed=0), np.zeros(42, dtype=bool)
    for _ in range(500):
        chip.step(np.array([]), {})
        spiked |= chip.state.spiked != 0
    assert 0 < silenced(image).sum() < 40
    assert not np.any(spiked & silenced(image))


def test_a_random_network_has_no_copies(chain: Callable[..., nengo.Network]) -> None:
    assert not duplicated(compile_network(chain()).image).any()
