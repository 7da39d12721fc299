"""`Split`: blocks that are cut into pieces which fit a core."""

import itertools

import nengo
import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.usage import out_slots
from spikeport.compile.passes.split import Split
from spikeport.compile.pipeline import compile_network
from spikeport.compile.placing.cut import cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import ProfileMasks, block_loads, capacity
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.same_run import assert_same_run, context, small_chip


def dense(n_pre: int = 6, n_post: int = 8) -> ChipImage:
    """Return neurons with a bias, each with a row of different weights to a whole second block."""
    weights = 64 * np.arange(1, n_pre * n_post + 1).reshape(n_pre, n_post)
    blocks = [Block(n_pre, bias=9_000, vth=2**16), Block(n_post, vth=2**15)]
    routes = [Route(range(n_pre), block=0)]
    return Parts(blocks, [Group(list(weights), block=1)], routes=routes).image()


def split(image: ChipImage, chip: ChipModel) -> ChipImage:
    after = Split().apply(image, context(chip))
    assert assert_same_run(image, after) > 0
    return after


def sizes(image: ChipImage) -> list[int]:
    return np.diff(image.blocks.start).tolist()


def test_a_block_that_fits_is_left_whole() -> None:
    image = dense()
    assert Split().apply(image, context()) is image


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"compartments": 5}, [5, 1, 5, 3]),
        ({"synapse_bits": 6 * 6 * 64}, [6, 6, 2]),  # these images store one synapse in a word
        ({"out_axons": 4}, [4, 2, 8]),
        # A target in two pieces takes two output axons of each of its sources.
        ({"synapse_bits": 6 * 6 * 64, "out_axons": 4}, [2, 2, 2, 6, 2]),
    ],
)
def test_pieces_are_as_large_as_a_core_allows(limits: dict[str, int], expected: list[int]) -> None:
    chip = small_chip(**limits)
    after = split(dense(), chip)
    assert sizes(after) == expected
    assert all(capacity(chip).holds(load) for load in block_loads(after, chip))


def test_a_piece_has_only_the_axons_that_reach_it() -> None:
    group = Group([[64, 64], [64, 64], [64] * 4], axon_base=[0, 2, 0], block=1)
    blocks = [Block(3, bias=9_000, vth=2**16), Block(4)]
    image = Parts(blocks, [group], routes=[Route(range(3), block=0)]).image()
    after = split(image, small_chip(compartments=3, in_axons=2))
    assert sizes(after) == [3, 2, 2]
    assert after.groups.axon_start.tolist() == [0, 2, 4]
    assert after.out_axons.axon.tolist() == [0, -1, 1, -1, 0, 1]


def test_pieces_are_named_after_the_whole() -> None:
    whole, *pieces = split(dense(), small_chip(compartments=6)).manifest.blocks
    assert (whole.label, whole.cut) == ("block 0", ())
    assert [piece.label for piece in pieces] == ["block 1[1/2]", "block 1[2/2]"]
    assert [piece.cut for piece in pieces] == [((0, 2),), ((1, 2),)]
    assert {(piece.built, piece.owner, piece.kind) for piece in pieces} == {
        ("block 1", "block 1", "ensemble")
    }


def test_the_number_of_pieces_of_a_block_is_noted() -> None:
    notes: dict[str, object] = {}
    Split().apply(dense(), context(small_chip(compartments=6), notes))
    assert notes == {"pieces": {"block 1": 2}}


@pytest.mark.parametrize(
    "group",
    [
        Group([[64] * 8], block=1, pop_type=32),
        Group([np.full((2, 8), 64)], block=1),
        Group([[64] * 8], block=1, learning=(1, 0, 0, 2, 8, 1, 1)),
    ],
)
def test_population_axons_and_learning_keep_a_block_whole(group: Group) -> None:
    image = Parts([Block(1), Block(8)], [group], routes=[Route([0], block=0)]).image()
    assert Split().apply(image, context(small_chip(compartments=4))) is image


def test_a_block_that_fits_because_it_shares_population_axons_is_left_whole() -> None:
    group = Group([np.full((3, 2), 64)] * 4, block=1, pop_type=32)
    route = Route(np.repeat(np.arange(4), 3), np.tile(np.arange(3), 4), block=0)
    image = Parts([Block(12, bias=9_000, vth=2**16), Block(2)], [group], routes=[route]).image()
    assert Split().apply(image, context(small_chip(out_axons=8))) is image
    # A piece is counted as if no axon were shared: 2 for each compartment.
    assert sizes(split(image, small_chip(out_axons=7))) == [3, 3, 3, 3, 2]


def test_a_block_with_one_compartment_too_large_for_a_core_is_left_whole() -> None:
    image = dense()
    assert Split().apply(image, context(small_chip(in_axons=5))) is image


def test_demands_equal_the_loads_of_pieces() -> None:
    image, chip = dense(), chips.get("loihi")
    demand = Demand(image, chip, 1, ProfileMasks(image))
    ends = [0, 3, 4, 8]
    pieces = block_loads(cut(image, {1: ends[1:-1]}), chip)[1:]
    slots = out_slots(image, chip)
    stretches = itertools.pairwise(ends)
    found = [demand.load(first, end, slots).amounts for first, end in stretches]
    assert found == [piece.amounts for piece in pieces]


@pytest.mark.slow
def test_an_ensemble_that_feeds_many_others_compiles() -> None:
    with nengo.Network(seed=1) as network:
        pre = nengo.Ensemble(600, 1, label="pre")
        for i in range(8):
            nengo.Connection(pre, nengo.Ensemble(20, 1, label=f"post {i}"))
    image = compile_network(network).image  # nengo-loihi gives ``pre`` 4,800 output axons
    assert image.blocks.core.max() + 1 == image.n_cores <= 4
