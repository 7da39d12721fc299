"""`MergeAxons`: equal rows and axons are merged, and those without effect are dropped."""

import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import GroupEntry
from spikeport.compile.passes.merge_axons import MergeAxons
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.same_run import assert_same_run, context

BIASED = Block(4, bias=60_000, vth=2**17)


def merged(image: ChipImage) -> ChipImage:
    after = MergeAxons().apply(image, context())
    assert assert_same_run(image, after) > 0
    return after


def test_equal_rows_share_a_row_and_an_axon() -> None:
    group = Group([[64, 0], [0, 64], [64, 0], [64, 0]], block=1)
    after = merged(Parts([BIASED, Block(2)], [group], routes=[Route(range(4), block=0)]).image())
    assert after.in_axons.row.tolist() == [0, 1]
    assert after.synapses.weight.tolist() == [64, 0, 0, 64]
    assert after.out_axons.axon.tolist() == [0, 1, 0, 0]


def test_equal_rows_with_different_bases_share_a_row_but_not_an_axon() -> None:
    group = Group([[64], [64]], axon_base=[0, 1], block=1)
    after = merged(
        Parts([BIASED, Block(2)], [group], routes=[Route([0, 1, 0, 1], block=0)]).image()
    )
    assert after.synapses.weight.tolist() == [64]
    assert after.in_axons.base.tolist() == [0, 1]


def test_axons_that_do_nothing_are_dropped() -> None:
    group = Group([[64], [0], [64], [65]], axon_base=[0, 0, -1, 0], block=1)
    # the second has no weight, the third no base, the fourth no source
    after = merged(
        Parts([BIASED, Block(2)], [group], routes=[Route([0, 1, 2, -1], block=0)]).image()
    )
    assert after.synapses.weight.tolist() == [64]
    assert after.out_axons.axon.tolist() == [0, -1, -1, -1]


def test_a_group_without_any_effect_is_dropped_with_its_routes() -> None:
    idle = Group([[0]], block=1)
    after = merged(Parts([BIASED, Block(2)], [idle], routes=[Route([0] * 4, block=0)]).image())
    assert len(after.groups) == len(after.routes) == 0


def test_groups_of_a_block_with_the_same_format_become_one() -> None:
    groups = [Group([[64, 64], [65, 65]], block=1), Group([[64, 64], [66, 66]], block=1)]
    routes = [Route([0, 1, -1, -1], block=0), Route([0, 0, 1, 1], group=1, block=0)]
    after = merged(Parts([BIASED, Block(2)], groups, routes=routes).image())
    assert after.groups.block.tolist() == [1]
    assert after.synapses.weight.tolist() == [64, 64, 65, 65, 66, 66]
    assert after.out_axons.axon.tolist() == [0, 1, -1, -1, 0, 0, 2, 2]
    assert after.manifest.groups == (GroupEntry("group 0"),)


@pytest.mark.parametrize(
    "other",
    [
        Group([[64, 64]], block=0),
        Group([[64, 64]], block=1, pop_type=32),
        Group([[64, 64]], indices=[[1, 0]], block=1),  # needs index bits
        Group([[64, 64]], block=1, learning=(1, 0, 0, 2, 8, 1, 1)),
    ],
)
def test_groups_that_differ_in_block_or_format_stay_apart(other: Group) -> None:
    routes = [Route([0] * 4, block=0), Route([0] * 4, group=1, block=0)]
    groups = [Group([[64, 64]], block=1), other]
    assert len(merged(Parts([BIASED, Block(2)], groups, routes=routes).image()).groups.block) == 2


def test_a_group_that_learns_stays_as_it_is() -> None:
    learning = Group([[64], [64], [0]], block=1, learning=(1, 0, 0, 2, 8, 1, 1))
    image = Parts([BIASED, Block(2)], [learning], routes=[Route([0, 1, 2, -1], block=0)]).image()
    assert MergeAxons().apply(image, context()) == image


def test_the_resources_before_and_after_are_noted() -> None:
    notes: dict[str, object] = {}
    group = Group([[64]] * 4, block=1)
    image = Parts([BIASED, Block(1)], [group], routes=[Route(range(4), block=0)]).image()
    MergeAxons().apply(image, context(note=notes))
    assert notes == {
        "in_axons": {"before": 4, "after": 1},
        "out_axons": {"before": 4, "after": 4},
        "synapse_bits": {"before": 4 * 64, "after": 64},
    }
    assert np.all(image.out_axons.axon == np.arange(4))
