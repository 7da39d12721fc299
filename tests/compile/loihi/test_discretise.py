"""Integer blocks: bit for bit those of nengo-loihi, made from copies of the float blocks."""

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import nengo
import nengo_loihi
import nengo_loihi.block
import nengo_loihi.builder.discretize
import nengo_loihi.neurons
import numpy as np
import pytest
from nengo_loihi.block import SynapseConfig

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.quantisation import block_values, restored_block
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.pipeline import compile_network
from spikeport.errors import CompileError
from tests.helpers.chip_networks import integer_blocks, recurrent

COMPARTMENT = ("bias", "vth", "decay_u", "decay_v", "refract_delay", "enable_noise")


SETTINGS = ("vmin", "vmax", "noise_offset", "noise_exp", "noise_at_membrane")


LEARNING = ("_lr_int", "_lr_exp", "tracing_tau", "tracing_mag", "train_epoch", "learn_epoch")


def learning() -> nengo.Network:
    with nengo.Network(seed=9) as network:
        a = nengo.Ensemble(30, 1, label="a")
        out = nengo.Node(size_in=1, label="out")
        learned = nengo.Connection(
            a, out, function=lambda _x: 0, learning_rule_type=nengo.PES(1e-3)
        )
        nengo.Connection(out, learned.learning_rule)
    return network


def theirs(network: nengo.Network) -> Any:
    with warnings.catch_warnings(), numpy1_semantics():
        warnings.simplefilter("ignore")
        with nengo_loihi.Simulator(network, precompute=False, target="sim") as simulator:
            return simulator.model


def numbers(model: Any) -> Iterator[tuple[str, Any]]:
    """Yield the numbers of nengo-loihi's model, or of `IntegerBlocks`."""
    for b, block in enumerate(model.blocks):
        for name in COMPARTMENT + SETTINGS:
            yield f"{b} {name}", getattr(block.compartment, name)
        for s, synapse in enumerate(block.synapses):
            yield f"{b} {s} format", list(vars(synapse.synapse_cfg).values())
            for name in ("axon_to_weight_map", "axon_compartment_bases"):
                yield f"{b} {s} {name}", getattr(synapse, name)
            for name in LEARNING if synapse.learning else ():
                yield f"{b} {s} {name}", getattr(synapse, name)
            for r, (weights, indices) in enumerate(
                zip(synapse.weights, synapse.indices, strict=True)
            ):
                yield f"{b} {s} {r} weights", weights
                yield f"{b} {s} {r} indices", indices
    for p, probe in enumerate(model.probes):
        yield f"probe {p}", np.hstack([np.ravel(w) for w in probe.weights if w is not None] or [0])


@pytest.mark.parametrize("name", ["chain", "convolution", "recurrent", "learning"])
def test_integer_blocks_equal_nengo_loihis_bit_for_bit(
    name: str, chain: Callable[..., nengo.Network], convolution: Callable[..., nengo.Network]
) -> None:
    makers = {
        "chain": chain,
        "convolution": convolution,
        "recurrent": recurrent,
        "learning": learning,
    }
    network = makers[name]()
    expected, found = dict(numbers(theirs(network))), dict(numbers(integer_blocks(network)))
    assert list(found) == list(expected)
    assert [key for key in found if not np.array_equal(found[key], expected[key])] == []


def test_discretising_leaves_the_float_blocks_as_they_were() -> None:
    floats = build(Rewrite(network := recurrent(), Names(network)), dt_s=0.001)
    before = [(b.compartment.vth.copy(), b.compartment.scale_u) for b in floats.blocks]
    discretise(floats)
    for block, (vth, scale_u) in zip(floats.blocks, before, strict=True):
        assert block.compartment.vth.dtype == np.float32
        assert np.array_equal(block.compartment.vth, vth)
        assert block.compartment.scale_u == scale_u
        assert block.discretize_info is None


def two_inputs(ratio: float, tau: float) -> nengo.Network:
    """Return neurons with a strong and a weak input through one slow filter."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, gain=np.ones(10), bias=np.ones(10), label="a")
        b = nengo.Ensemble(10, 1, gain=np.ones(10), bias=np.ones(10), label="b")
        for size in (1.0, ratio):
            matrix = size * np.random.RandomState(0).uniform(0.5, 1, (10, 10))
            nengo.Connection(a.neurons, b.neurons, transform=matrix * 1e-3, synapse=tau)
    return network


@pytest.mark.parametrize("ratio", [0.3, 0.1, 0.05])
def test_weights_below_the_least_exponent_are_not_multiplied(ratio: float) -> None:
    """nengo-loihi's own integers stand for weights up to 8 times as large."""
    network = two_inputs(ratio, tau=0.1)
    floats = build(Rewrite(network, Names(network)), dt_s=0.001)
    blocks = discretise(floats)
    wanted = block_values(floats.blocks[1])
    found = restored_block(wanted, blocks.blocks[1])
    for exact, rounded in zip(wanted.weights, found.weights, strict=True):
        assert np.linalg.norm(rounded - exact) < 0.6 * np.linalg.norm(exact)


def loop(transform: float, fed: bool) -> nengo.Network:
    with nengo.Network(seed=0) as network:
        a = nengo.Ensemble(20, 1, label="a")
        if fed:
            nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a, a, transform=transform, synapse=0.1)
    return network


def exact_and_rounded(blocks: IntegerBlocks) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the weights of each group of synapses in the chip's units, before and after rounding.

    The chip adds multiples of 64 to a current.
    """
    for built, block in zip(blocks.floats.blocks, blocks.blocks, strict=True):
        info = block.discretize_info
        # The scale is one number, or the same number for every compartment.
        scale = np.max(info["w_scale"]) * SynapseConfig.get_scale(info["w_exp"]) / 64
        for exact, synapse in zip(block_values(built).weights, block.synapses, strict=True):
            yield exact * scale, np.concatenate([row.ravel() for row in synapse.weights]) / 64


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("fed", [False, True])
@pytest.mark.parametrize("decade", range(-12, 0))
def test_weights_of_a_loop_of_any_strength_are_rounded_by_at_most_a_unit(
    decade: int, fed: bool, pipeline: str
) -> None:
    """A hint says so if all weights of a group are below half a unit, and rounded to zero."""
    compilation = compile_network(loop(10.0**decade, fed), pipeline=pipeline)
    lost = []
    for exact, rounded in exact_and_rounded(compilation.blocks):
        np.testing.assert_allclose(rounded, exact, rtol=0, atol=1 + 1e-9)
        lost.append(bool(np.abs(exact).max() < 0.5))
        assert rounded.any() != lost[-1]
    zeros = {hint.object for hint in compilation.report.hints if hint.id == "SP402"}
    assert zeros <= {"a", "a -> a"}
    assert bool(zeros) == any(lost)
    if decade == -1:
        assert not zeros
    if decade <= -9:
        assert zeros


def test_weights_too_small_for_every_exponent_become_zero_and_thresholds_stay() -> None:
    blocks = integer_blocks(loop(1e-6, fed=False))
    assert blocks.rounded_away
    wanted = block_values(blocks.floats.blocks[0])
    found = restored_block(wanted, blocks.blocks[0])
    assert np.allclose(found.neurons.vth, wanted.neurons.vth, rtol=1e-3)
    assert np.allclose(found.bias, wanted.bias, rtol=0.05, atol=1e-3)


HOST = (
    "or keep its ensembles on the host with net.config[ensemble].on_chip = False, after "
    "spikeport.add_params(net)"
)


def test_the_error_of_a_block_without_a_weight_exponent_names_the_block() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(2, 1, label="a", gain=np.ones(2), bias=np.full(2, 1e9))
        nengo.Connection(a.neurons, a.neurons, transform=1e-6)
    with pytest.raises(CompileError) as raised:
        integer_blocks(network)
    assert str(raised.value) == (
        "a: nengo-loihi refuses it: Compartment(<Ensemble 'a'>): Could not find appropriate weight "
        f"exponent; cure: bring its weights, gains and biases closer together, {HOST}"
    )


def test_weights_of_1e_12_into_some_neurons_of_an_ensemble_are_rounded() -> None:
    """nengo-loihi scales such weights by a number for each neuron, here also for the last."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(60, 2, encoders=np.tile([[1.0, 0], [1, 0], [0, 1]], (20, 1)))
        b = nengo.Ensemble(30, 1)
        nengo.Connection(b, a[0], transform=1e-12)
    assert len(compile_network(network, pipeline="decode_path").image.synapses.weight)
