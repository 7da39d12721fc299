"""Spikes between blocks and cores if every source spikes once."""

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.traffic import block_traffic, core_messages, reached_blocks
from tests.helpers.images import Block, Group, Parts, Route


def network() -> ChipImage:
    """Return an image of 2 compartments and an input that reach 2 blocks, one by 2 routes."""
    groups = [Group([[64], [64]], block=1), Group([[64]], block=2), Group([[64]], block=1)]
    routes = [
        Route([0, 1], group=0, block=0),
        Route([0, -1], group=1, block=0),
        Route([0, -1], group=2, block=0),
        Route([0], group=0, input=0),
        Route([0], group=1, input=0),
    ]
    blocks = [Block(2), Block(1, core=1), Block(1, core=1)]
    return Parts(blocks, groups, [1], routes).image()


def test_a_block_that_is_reached_twice_counts_once() -> None:
    assert reached_blocks(network()).toarray().tolist() == [
        [0, 1, 1],
        [0, 1, 0],
        [0, 0, 0],
        [0, 0, 0],
        [0, 1, 1],
    ]


def test_traffic_between_blocks_counts_direct_spikes_and_shared_sources() -> None:
    # block 0 sends two spikes to block 1, one to block 2; two sources reach both of these
    traffic = block_traffic(network())
    assert traffic.direct.toarray().tolist() == [[0, 2, 1], [2, 0, 0], [1, 0, 0]]
    assert traffic.audiences == {(1, 2): 2}


def test_spikes_of_the_last_compartment_count_too() -> None:
    routes = [Route([0], block=1)]
    image = Parts([Block(1), Block(1)], [Group([[64]], block=0)], routes=routes).image()
    assert block_traffic(image).direct.toarray().tolist() == [[0, 1], [1, 0]]


def test_pairs_of_blocks_are_listed_as_audiences_of_two_after_the_others() -> None:
    traffic = block_traffic(network())
    assert traffic.members.toarray().tolist() == [[0, 1, 1], [1, 1, 0], [1, 0, 1]]
    assert traffic.sources.tolist() == [2, 2, 1]


def test_a_source_that_reaches_many_blocks_is_one_audience_and_not_pairs() -> None:
    n = 200
    groups = [Group([[64]], block=b) for b in range(1, n)]
    routes = [Route([0], group=g, block=0) for g in range(n - 1)]
    traffic = block_traffic(Parts([Block(1) for _ in range(n)], groups, routes=routes).image())
    assert traffic.audiences == {tuple(range(1, n)): 1}
    assert traffic.direct.nnz == 2 * (n - 1)


def test_a_spike_is_one_message_to_a_core_however_many_blocks_it_reaches() -> None:
    assert core_messages(network()).tolist() == [[0, 2], [0, 0]]
