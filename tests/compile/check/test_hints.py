from collections.abc import Callable

import nengo
import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.drive import duplicated, silenced
from spikeport.compile.check.hints import image_hints, network_hints
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network


def neurons(label: str, bias: list[float]) -> nengo.Ensemble:
    gain = np.ones(len(bias))
    return nengo.Ensemble(len(bias), 1, label=label, gain=gain, bias=bias)


def wired(weights: list[list[float]], bias: list[float]) -> ChipImage:
    """Two neurons that always spike, wired to as many as there are biases."""
    with nengo.Network(seed=1) as network:
        pre, post = neurons("pre", [3.0, 4.0]), neurons("post", bias)
        nengo.Connection(pre.neurons, post.neurons, transform=weights, synapse=0.005)
    return compile_network(network, pipeline="").image


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


def test_weights_of_zero_are_found() -> None:
    assert "post: SP402 zero weights: all of its weights are 0; cure: remove the connection" in (
        "\n".join(hints(wired([[0, 0]], [2.0])))
    )
    assert "SP402" not in "\n".join(hints(wired([[0, 1]], [2.0])))


def test_lost_weights_are_worth_a_hint_above_a_tenth() -> None:
    image = wired([[1, 1]], [1.0])
    few, many = BlockError("few", 0, 0, 0.1), BlockError("many", 0, 0, 0.25)
    assert hints(image, few, many)[0].startswith("many: SP403 weights lost: 25 % of them; cure: ")


def test_a_dead_end_is_found() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(4, 1, label="a")
        end = nengo.Node(size_in=1, label="end")
        nengo.Connection(a, end)
        probed, passed = nengo.Node(size_in=1), nengo.Node(size_in=1)
        nengo.Connection(a, probed)
        nengo.Probe(probed)
        nengo.Connection(a, passed)
        nengo.Connection(passed, a)
    assert [str(hint) for hint in network_hints(network, Names(network))] == [
        "end: SP401 dead end: leads nowhere and is not probed; cure: probe it, or give it a "
        "function, as in nengo.Node(lambda t, x: x, size_in=...)"
    ]


def test_outputs_of_an_ensemble_array_that_nobody_reads_are_no_dead_ends() -> None:
    with nengo.Network(seed=1) as network:
        array = nengo.networks.EnsembleArray(4, 2)
        squares = array.add_output("squares", np.square)
        nengo.Probe(squares)
    assert list(network_hints(network, Names(network))) == []


def test_a_random_network_has_no_copies(chain: Callable[..., nengo.Network]) -> None:
    assert not duplicated(compile_network(chain()).image).any()


def test_an_ensemble_with_an_arrow_in_its_label_is_no_relay() -> None:
    """A label is for people: the kind of a block is data."""
    with nengo.Network(seed=1) as network:
        encoders = np.ones((10, 1))
        one = {"gain": np.ones(10), "bias": np.ones(10), "encoders": encoders}
        nengo.Ensemble(10, 1, label="left -> right", **one)
    hints = compile_network(network).report.hints
    assert [(hint.id, hint.object, hint.used) for hint in hints] == [
        ("SP404", "left -> right", "9 of 10")
    ]
