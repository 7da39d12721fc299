"""Texts that describe the networks, blocks and images that passes leave."""

import nengo
import pytest

from spikeport.compile.passes.dump import dump
from tests.helpers.chip_networks import integer_blocks
from tests.helpers.small_networks import rewrite_of
from tests.helpers.two_blocks import two_blocks


def test_the_text_of_an_image_lists_its_cores_blocks_groups_and_routes() -> None:
    vth = 2**23 - 1
    assert dump(two_blocks()) == [
        "core 0: blocks 0",
        "core 1: blocks 1",
        f"block 0 block 0: compartments 0 to 1, thresholds {vth}",
        f"block 1 block 1: compartments 2 to 4, thresholds {vth}",
        "synapses 0 of block 1: 2 axons in, 2 rows, 4 weights",
        "route block 0 -> synapses 0: 2 axons out to 2 in",
        "route input 0 -> synapses 0: 1 axons out to 1 in",
    ]


def network() -> nengo.Network:
    with nengo.Network(seed=1) as made:
        a = nengo.Ensemble(5, 2, label="a")
        end = nengo.Node(size_in=1, label="end")
        nengo.Connection(a[0], end, synapse=0.01)
        nengo.Probe(a.neurons, label="spikes")
    return made


def test_the_text_of_a_network_lists_its_objects() -> None:
    assert dump(rewrite_of(network())) == [
        "ensemble a: 5 LIF, 2 d",
        "node end: 1 -> 1",
        "connection a -> end: 1 of ensemble -> 1 of node, Lowpass(tau=0.01)",
        "probe spikes: output of a",
    ]


def test_blocks_are_described_without_addresses() -> None:
    first, *_ = dump(integer_blocks(network()).floats)
    assert first == "block 0 <Ensemble 'a'>: 5 compartments, 1 thresholds, 0 axons in, 0 rows"


def test_an_object_of_another_kind_is_refused() -> None:
    with pytest.raises(TypeError, match=r"^cannot describe a int as text$"):
        dump(3)
