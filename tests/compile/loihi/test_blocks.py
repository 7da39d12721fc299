"""Copies of nengo-loihi's blocks, which can be changed without changing the originals."""

import nengo
import numpy as np
from nengo_loihi.block import LoihiBlock, Synapse
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.loihi.blocks import copied, copied_probe, first_of
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from tests.helpers.chip_networks import integer_blocks, neurons, recurrent


def block() -> LoihiBlock:
    made = LoihiBlock(2, label="made")
    made.compartment.bias[:] = [1, 2]
    synapse = Synapse(1)
    with numpy1_semantics():
        synapse.set_weights(np.ones((1, 2)))
    made.add_synapse(synapse)
    return made


def test_changing_a_copy_leaves_the_original() -> None:
    original = block()
    copy = copied(original)
    copy.compartment.bias[0] = 9
    copy.compartment.vmin = -5
    copy.synapses[0].weights[0][0, 0] = 9
    copy.synapses[0].synapse_cfg.weight_exp = 3
    copy.synapses.append(None)
    fresh = block()
    assert original.compartment.bias.tolist() == [1, 2]
    assert original.compartment.vmin == fresh.compartment.vmin
    assert original.synapses[0].weights[0].tolist() == [[1, 1]]
    assert original.synapses[0].synapse_cfg.weight_exp == fresh.synapses[0].synapse_cfg.weight_exp
    assert len(original.synapses) == 1


def test_a_copy_shares_the_axons_of_the_original() -> None:
    original = block()
    original.axons = [object()]
    assert copied(original).axons is original.axons


def test_a_copied_probe_has_its_own_weights_in_the_same_memory_order() -> None:
    weights = [np.asfortranarray(np.eye(2)), None]
    original = LoihiProbe(target=[block(), block()], weights=weights, slice=[slice(None)] * 2)
    copy = copied_probe(original)
    copy.weights[0][0, 0] = 7
    assert original.weights[0][0, 0] == 1
    assert copy.weights[0].flags.f_contiguous
    assert copy.weights[1] is None
    assert copy.target is original.target


def test_first_of_returns_the_first_block_of_an_object() -> None:
    one, other = block(), block()
    assert first_of(one) is first_of([one, other]) is one


def test_with_blocks_replaces_the_blocks_but_keeps_labels_and_model() -> None:
    floats = integer_blocks(recurrent()).floats
    other = floats.with_blocks(map(copied, floats.blocks))
    assert other.labels == floats.labels
    assert other.model is floats.model
    assert all(a is not b for a, b in zip(other.blocks, floats.blocks, strict=True))


def test_a_group_that_keeps_some_of_its_weights_is_not_rounded_away() -> None:
    with nengo.Network(seed=0) as network:
        pre, post = neurons("pre", [2.0, 2.0]), neurons("post", [2.0, 2.0])
        nengo.Connection(pre.neurons, post.neurons, transform=[[1.0, 1e-3], [1e-3, 1.0]])
    blocks = integer_blocks(network)
    (weights,) = (synapse.weights for block in blocks.blocks for synapse in block.synapses)
    assert np.ravel(weights).astype(bool).tolist() == [True, False, False, True]
    assert not blocks.rounded_away
