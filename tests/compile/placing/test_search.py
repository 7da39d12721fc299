"""The search for cuts: pieces as long as there is room for."""

import math

import pytest

from spikeport.compile.placing.load import Capacity
from spikeport.compile.placing.search import Search
from spikeport.hardware_models import chip as chips
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.two_blocks import two_blocks

LOIHI = chips.get("loihi")
INF = math.inf


def room(compartments: float = INF, in_axons: float = INF, out_axons: float = INF) -> Capacity:
    return Capacity((compartments, in_axons, out_axons, INF), (INF,) * 6)


@pytest.mark.parametrize(
    ("capacity", "cuts"),
    [
        (room(), {}),
        (room(compartments=3), {}),
        (room(compartments=2), {1: [2]}),
        (room(compartments=1), {0: [1], 1: [1, 2]}),
        # the last compartment alone needs both axons
        (room(in_axons=1), {}),
        # Compartment 0 has two output axons if its target is in two pieces: it fills a core.
        (room(compartments=2, out_axons=2), {0: [1], 1: [2]}),
    ],
)
def test_pieces_are_as_long_as_there_is_room_for(
    capacity: Capacity, cuts: dict[int, list[int]]
) -> None:
    assert Search(two_blocks(), LOIHI).cuts(capacity) == cuts


def test_a_block_that_cannot_be_cut_is_left_out() -> None:
    group = Group([[64] * 8], pop_type=32)
    image = Parts([Block(8), Block(8)], [group]).image()
    assert Search(image, LOIHI).cuts(room(compartments=4)) == {1: [4]}


def test_axons_of_the_host_take_no_room() -> None:
    group = Group([[64] * 6])
    image = Parts([Block(6)], [group], inputs=[9], routes=[Route([0] * 9, input=0)]).image()
    capacity = room(compartments=4, out_axons=1)
    assert Search(image, LOIHI).cuts(capacity) == {0: [4]}


def test_room_once_taken_is_not_given_back_so_that_the_search_ends() -> None:
    """The first axon has targets on both sides of 4, but not of 3: cuts would alternate."""
    group = Group([[64, 64], *[[64]] * 5], axon_base=[3, 1, 2, 3, 4, 5])
    image = Parts([Block(6)], [group], routes=[Route(range(6), block=0)]).image()
    capacity = room(compartments=4, out_axons=4)
    assert Search(image, LOIHI).cuts(capacity) == {0: [3]}


def test_a_block_whose_rows_exceed_the_memory_of_a_soft_core_is_cut() -> None:
    chip = chips.get("softcore-ecp5-85f")
    # 2,048 rows, each of 2 header words and 31 words with two weights; a word has 16 bits.
    sources, targets, limit = 2048, 62, 2**20
    assert 16 * (2 + targets // 2) * sources > limit > 8 * targets * sources
    block, group = Block(targets), Group([[64] * targets] * sources)
    image = Parts([block], [group], inputs=[sources], routes=[Route(range(sources), input=0)])
    cuts = Search(image.image(), chip).cuts(Capacity((INF, INF, INF, limit), (INF,) * 6))
    assert cuts == {0: [60]}
