"""Cuts of blocks into stretches of their compartments."""

from spikeport.compile.placing.cut import can_cut, cut
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.two_blocks import two_blocks


def test_a_target_that_is_cut_has_axons_of_each_piece() -> None:
    after = cut(two_blocks(), {1: [2]})
    assert after.blocks.start.tolist() == [0, 2, 4, 5]
    assert after.blocks.core.tolist() == [0, 1, 2]
    # The first piece lacks axon 1, whose only target is the last compartment.
    assert after.groups.block.tolist() == [1, 2]
    assert after.groups.axon_start.tolist() == [0, 1, 3]
    assert after.synapses.weight.tolist() == [64, 128, 192, 320]
    assert after.synapses.index.tolist() == [0, 1, 0, 0]
    # Compartment 0 reaches both pieces, compartment 1 and the host the second alone.
    assert after.routes.from_input.tolist() == [0, 0, 1]
    assert after.routes.group.tolist() == [0, 1, 1]
    assert after.out_axons.axon.tolist() == [0, -1, 0, 1, 1]


def test_a_source_that_is_cut_sends_from_each_piece() -> None:
    after = cut(two_blocks(), {0: [1]})
    assert after.blocks.start.tolist() == [0, 1, 2, 5]
    assert after.groups.block.tolist() == [2]
    assert after.routes.source.tolist() == [0, 1, 0]
    assert after.routes.from_input.tolist() == [0, 0, 1]
    assert after.routes.start.tolist() == [0, 1, 2, 3]
    assert after.out_axons.axon.tolist() == [0, 1, 1]


def test_a_piece_that_begins_within_a_row_counts_its_targets_from_there() -> None:
    group = Group([[64, 128, 192]], axon_base=[1], block=1)
    image = Parts([Block(1), Block(4)], [group], routes=[Route([0], block=0)]).image()
    after = cut(image, {1: [2]})  # targets 1, 2 and 3
    assert after.synapses.weight.tolist() == [64, 128, 192]
    assert after.synapses.index.tolist() == [0, 0, 1]
    assert after.in_axons.base.tolist() == [1, 0]


def test_axons_that_share_a_row_share_its_pieces() -> None:
    group = Group([[64, 128]], axon_row=[0, 0], axon_base=[0, 0], block=1)
    image = Parts([Block(2), Block(2)], [group], routes=[Route([0, 1], block=0)]).image()
    after = cut(image, {1: [1]})
    assert after.synapses.weight.tolist() == [64, 128]
    assert after.in_axons.row.tolist() == [0, 0, 0, 0]


def test_only_blocks_with_plain_axons_that_do_not_learn_can_be_cut() -> None:
    learning = (1, 0, 0, 2, 8, 1, 1)
    groups = [
        Group([[64]], block=1, pop_type=32),
        Group([[[64], [128]]], block=2),
        Group([[64]], block=3, learning=learning),
        Group([[64]], block=4),
        Group([[[64], [128]]], block=4),
    ]
    image = Parts([Block() for _ in range(5)], groups).image()
    assert can_cut(image).tolist() == [True, False, False, False, False]
