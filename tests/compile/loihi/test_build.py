import os
import subprocess
import sys
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

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.pipeline import compile_network
from spikeport.errors import CompileError

COMPARTMENT = ("bias", "vth", "decay_u", "decay_v", "refract_delay", "enable_noise")
SETTINGS = ("vmin", "vmax", "noise_offset", "noise_exp", "noise_at_membrane")
LEARNING = ("_lr_int", "_lr_exp", "tracing_tau", "tracing_mag", "train_epoch", "learn_epoch")


def recurrent() -> nengo.Network:
    with nengo.Network(seed=8) as network:
        a = nengo.Ensemble(30, 2, radius=1.3, label="a")
        b = nengo.Ensemble(20, 1, neuron_type=nengo.SpikingRectifiedLinear(), label="b")
        nengo.Connection(a, a, synapse=0.1, function=lambda x: x**2)
        nengo.Connection(a[0], b, solver=nengo.solvers.LstsqL2(weights=True))
        nengo.Connection(b.neurons[3:9], a.neurons, transform=np.eye(30, 6) * 1e-3)
        nengo.Probe(b)
    return network


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


def ours(network: nengo.Network) -> IntegerBlocks:
    return discretise(build(Rewrite(network, Names(network)), dt_s=0.001))


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
def test_blocks_are_nengo_loihis_bit_for_bit(
    name: str, chain: Callable[..., nengo.Network], convolution: Callable[..., nengo.Network]
) -> None:
    makers = {
        "chain": chain,
        "convolution": convolution,
        "recurrent": recurrent,
        "learning": learning,
    }
    network = makers[name]()
    expected, found = dict(numbers(theirs(network))), dict(numbers(ours(network)))
    assert list(found) == list(expected)
    assert [key for key in found if not np.array_equal(found[key], expected[key])] == []


def test_blocks_are_called_after_ensembles_and_connections() -> None:
    assert ours(recurrent()).floats.labels == ("a", "b", "a -> a", "b -> probes[0]")


def test_pieces_of_a_block_are_numbered(convolution: Callable[..., nengo.Network]) -> None:
    assert ours(convolution()).floats.labels == ("image", "maps[1/2]", "maps[2/2]")


def test_the_kind_and_owner_of_a_block_are_data() -> None:
    entries = ours(recurrent()).floats.entries
    assert [entry.kind for entry in entries] == ["ensemble", "ensemble", "relay", "readout"]
    assert [entry.owner for entry in entries] == ["a", "b", "a -> a", "b -> probes[0]"]


def test_discretising_leaves_the_float_blocks_as_they_were() -> None:
    floats = build(Rewrite(network := recurrent(), Names(network)), dt_s=0.001)
    before = [(b.compartment.vth.copy(), b.compartment.scale_u) for b in floats.blocks]
    discretise(floats)
    for block, (vth, scale_u) in zip(floats.blocks, before, strict=True):
        assert block.compartment.vth.dtype == np.float32
        assert np.array_equal(block.compartment.vth, vth)
        assert block.compartment.scale_u == scale_u
        assert block.discretize_info is None


def test_what_the_builder_warns_of_is_kept_without_addresses() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1)
        nengo.Connection(a, a, synapse=0.1)
        nengo.Connection(a.neurons, a.neurons, transform=np.eye(10), synapse=0.02)
    blocks = ours(network)
    assert "tau_s is currently 0.005, which is smaller than 0.02. Overwriting tau_s with 0.02." in (
        blocks.warnings
    )
    assert not [text for text in blocks.warnings if " at 0x" in text]


def test_a_transform_that_is_not_finite_is_refused() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b, transform=np.nan)
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "a -> b: SP011 finite numbers: NaN or infinity in weights or biases, limit finite numbers; "
        "cure: look for a division by zero, a root or logarithm out of range, or an overflow there"
    )


HOST = "or keep its ensembles on the host with net.config[ensemble].on_chip = False"


def test_a_refusal_by_bare_assertion_names_the_object() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 2, label="b")
        nengo.Connection(a, b[1])
    with pytest.raises(CompileError) as raised:
        ours(network)  # without lint, which knows this one
    assert str(raised.value) == (
        "a -> b: nengo-loihi refuses it: AssertionError at build_full_chip_connection: "
        f"assert post_slice == slice(None); cure: change this object, {HOST}"
    )


def test_a_refusal_with_reason_gives_the_reason_without_addresses() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, encoders=np.zeros((10, 1)))
        nengo.Connection(a, a)
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "ensembles[0]: nengo-loihi refuses it: <Ensemble (unlabeled)>: NaNs detected in encoders. "
        "This usually means that you have zero-length encoders; when normalized, these result in "
        "NaNs. Ensure all encoders have non-zero length, or set `normalize_encoders=False`.; "
        f"cure: change this object, {HOST}"
    )


def test_an_error_in_a_users_function_names_the_connection() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(10, 1, label="a")
        b = nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b, function=lambda x: 1 / 0 if x.any() else 0.0)
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "a -> b: nengo-loihi refuses it: ZeroDivisionError: division by zero; "
        f"cure: change this object, {HOST}"
    )


def test_a_scale_that_does_not_exist_names_the_block() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(2, 1, label="a", gain=np.ones(2), bias=np.full(2, 1e9))
        nengo.Connection(a.neurons, a.neurons, transform=1e-6)
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "a: nengo-loihi refuses it: Compartment(<Ensemble 'a'>): Could not find appropriate weight "
        f"exponent; cure: bring its weights, gains and biases closer together, {HOST}"
    )


def split_ensemble() -> nengo.Ensemble:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    a = nengo.Ensemble(10, 1, label="a")
    network.config[a].block_shape = nengo_loihi.BlockShape((5,), (10,))
    return a


@pytest.mark.parametrize("neurons", [[7, 2], slice(None, None, -1)], ids=["list", "backwards"])
def test_split_neurons_must_be_read_in_order(neurons: Any) -> None:
    with nengo.Network(seed=1) as network:
        nengo.Probe(split_ensemble().neurons[neurons])
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "a: its neurons are read out in another order than theirs, which fails where they are "
        "split over several cores; cure: read them in ascending order"
    )


def probed_end(output: object) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
        through = nengo.Node(size_in=1, label="through")
        end = nengo.Node(output, size_in=1, label="end")
        nengo.Connection(a, through)
        nengo.Connection(through, b)
        nengo.Connection(through, end)
        nengo.Probe(through)
        nengo.Probe(end)
    return network


def test_a_probed_node_that_the_builder_cuts_off_is_refused() -> None:
    with pytest.raises(CompileError) as raised:
        ours(probed_end(None))
    assert str(raised.value) == (
        "end: nengo-loihi removes what feeds this passthrough node, and its probe would read "
        "zeros; cure: give it a function, as in nengo.Node(lambda t, x: x, size_in=...)"
    )


def test_the_cure_for_a_cut_off_node_helps() -> None:
    assert ours(probed_end(lambda _t, x: x)).model.probes


def test_population_16_axons_must_start_at_multiples_of_4() -> None:
    kernel = np.ones((2, 2, 1, 3))
    filters = nengo.Convolution(3, (3, 3, 1), kernel_size=(2, 2), init=kernel)
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        a = nengo.Ensemble(9, 1, label="a")
        b = nengo.Ensemble(12, 1, label="b", gain=np.ones(12), bias=np.ones(12))
        edge = nengo.Connection(a.neurons, b.neurons, transform=filters)
        network.config[edge].pop_type = 16
    with pytest.raises(CompileError) as raised:
        ours(network)
    assert str(raised.value) == (
        "b: axons of population type 16 start at compartments that are not multiples of 4; cure: "
        "use pop_type 32, or channels_last=True with a multiple of 4 filters, also in each block"
    )


def patched() -> tuple[Any, ...]:
    modules = (nengo_loihi.block, nengo_loihi.neurons)
    numpys = tuple(module.np for module in modules)
    builder = nengo_loihi.builder.discretize.discretize_compartment
    return (nengo_loihi.block.Synapse.max_abs_weight, builder, *numpys)


def test_numpy_1_semantics_end_with_the_block() -> None:
    before = patched()
    with numpy1_semantics():
        assert patched()[:2] != before[:2]
    assert patched() == before


def test_numpy_1_semantics_end_with_an_exception() -> None:
    before = patched()
    with pytest.raises(ZeroDivisionError), numpy1_semantics():
        raise ZeroDivisionError
    assert patched() == before


def test_numpy_1_semantics_are_gone_after_a_refused_build() -> None:
    before = patched()
    with nengo.Network(seed=1) as network:
        nengo.Connection(nengo.Ensemble(10, 1), nengo.Ensemble(10, 2)[1])
    with pytest.raises(CompileError):
        ours(network)
    assert patched() == before


def test_the_largest_weight_is_wide_inside_and_narrow_outside() -> None:
    synapse = nengo_loihi.block.Synapse(1)
    with numpy1_semantics():
        synapse.set_weights(np.ones((1, 3)))
        assert type(synapse.max_abs_weight()) is float
    assert type(synapse.max_abs_weight()) is np.float32


def test_an_unseeded_network_gives_the_same_image_every_time(
    chain: Callable[..., nengo.Network],
) -> None:
    digests = set()
    for seed in (1, 2):
        np.random.seed(seed)
        digests.add(compile_network(chain(seed=None)).image.digest)
    assert len(digests) == 1


def test_another_seed_gives_another_image(chain: Callable[..., nengo.Network]) -> None:
    assert compile_network(chain(seed=1)).image != compile_network(chain(seed=2)).image


PASSTHROUGH = """
import sys
import warnings
import nengo
import spikeport

def arrays():
    a = nengo.networks.EnsembleArray(10, 3)
    b = nengo.networks.EnsembleArray(10, 3, ens_dimensions=1)
    nengo.Connection(a.output, b.input, transform=[[0, 1, 0], [1, 0, 1], [0.5, 0, -1]])
    nengo.Probe(b.output)

def product():
    product = nengo.networks.Product(10, 2)
    a = nengo.Ensemble(20, 2)
    b = nengo.Ensemble(20, 2)
    nengo.Connection(a, product.input_a)
    nengo.Connection(a, product.input_b, function=lambda x: x[::-1])
    nengo.Connection(product.output, b)

def basal_ganglia():
    bg = nengo.networks.BasalGanglia(2, n_neurons_per_ensemble=10)
    thalamus = nengo.networks.Thalamus(2, n_neurons_per_ensemble=10)
    a = nengo.Ensemble(20, 2)
    nengo.Connection(bg.output, thalamus.input)
    nengo.Connection(a, bg.input)
    nengo.Connection(thalamus.output, a)

warnings.simplefilter("ignore")
for make in (arrays, product, basal_ganglia):
    with nengo.Network() as network:
        make()
    print(spikeport.compile_network(network).image.digest)
"""


def test_networks_with_passthrough_nodes_give_the_same_image_in_every_process() -> None:
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", PASSTHROUGH],
            env={**os.environ, "PYTHONHASHSEED": seed, "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in ("1", "2", "3")
    ]
    outputs = [run.communicate(timeout=60)[0].split() for run in runs]
    assert [len(digests) for digests in outputs] == [3, 3, 3]
    assert outputs[0] == outputs[1] == outputs[2]
