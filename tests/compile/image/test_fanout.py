from collections.abc import Callable

import nengo
import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.fanout import all_operations, fanout
from spikeport.compile.pipeline import Compilation, compile_network


def by_brute_force(compilation: Compilation) -> tuple[np.ndarray, np.ndarray]:
    """Follow every spike through nengo-loihi's own axons and synapses."""
    model = compilation.model
    core = {s: c for c, block in enumerate(model.blocks) for s in block.synapses}
    sources = [(s, i) for s in [*model.blocks, *model.inputs] for i in range(s.n_neurons)]
    operations = np.zeros((len(sources), len(model.blocks)), int)
    messages = np.zeros_like(operations)
    for number, (source, i) in enumerate(sources):
        for axon in source.axons:
            for spike in axon.map_spikes(np.array([i])):
                if spike is None:
                    continue
                messages[number, core[axon.target]] = 1
                if axon.target.axon_compartment_base(spike.axon_idx) is not None:
                    weights, _ = axon.target.axon_weights_indices(spike.axon_idx, spike.atom)
                    operations[number, core[axon.target]] += len(weights)
    return operations, messages


def mixed() -> nengo.Network:
    with nengo.Network(seed=2) as network:
        u = nengo.Node(0.5)
        a = nengo.Ensemble(20, 2, label="a")
        b = nengo.Ensemble(15, 1, label="b")
        nengo.Connection(u, a, transform=[[1], [0.5]])
        nengo.Connection(a, a)
        nengo.Connection(a[0], b)
        nengo.Connection(b.neurons[2:9], a.neurons, transform=np.full((20, 7), 1e-3))
        one = nengo.Sparse((20, 15), indices=[(3, 4)], init=1e-3)
        nengo.Connection(b.neurons, a.neurons, transform=one)
        nengo.Probe(a)
    return network


@pytest.mark.parametrize("name", ["chain", "convolution", "mixed"])
def test_fanout_is_that_of_nengo_loihis_axons(
    name: str, compiled_chain: Compilation, compiled_convolution: Compilation
) -> None:
    compilation = {"chain": compiled_chain, "convolution": compiled_convolution}.get(name)
    compilation = compilation or compile_network(mixed(), pipeline="")
    found = fanout(compilation.image)
    operations, messages = by_brute_force(compilation)
    assert np.array_equal(found.synaptic_operations, operations)
    assert np.array_equal(found.messages, messages)
    assert all_operations(compilation.image) == operations.sum() > 0


def test_fanout_counted_by_hand(neuron_network: Callable[..., nengo.Network]) -> None:
    network = neuron_network(np.ones((6, 3)), 4, 6, slice(1, 4))
    found = fanout(compile_network(network, pipeline="").image)
    # Neurons 1 to 3 of pre (core 0) reach all 6 of post (core 1); nothing else has an axon.
    assert found.synaptic_operations.tolist() == [[0, 0], [0, 6], [0, 6], [0, 6]] + [[0, 0]] * 6
    assert found.messages.tolist() == [[0, 0], [0, 1], [0, 1], [0, 1]] + [[0, 0]] * 6


def test_a_spike_to_several_groups_on_one_core_is_one_message(image: ChipImage) -> None:
    apart = fanout(image)
    together = fanout(image.on_cores(np.zeros(image.n_blocks)))
    assert np.array_equal(
        together.synaptic_operations, apart.synaptic_operations.sum(axis=1, keepdims=True)
    )
    assert np.array_equal(together.messages, apart.messages.max(axis=1, keepdims=True))


def test_a_network_without_axons_has_no_fanout() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(5, 1)
    found = fanout(compile_network(network, pipeline="").image)
    assert found.synaptic_operations.tolist() == found.messages.tolist() == [[0]] * 5
