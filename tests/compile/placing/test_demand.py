"""Resources of a stretch, computed without a cut, against those of the piece after the cut."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.usage import out_slots
from spikeport.compile.placing.cut import can_cut, cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import Capacity, ProfileMasks, block_loads
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from tests.helpers.images import Block, Group, Parts, images
from tests.helpers.two_blocks import two_blocks

LOIHI, SOFT = chips.get("loihi"), chips.get("softcore-ecp5-85f")
INF = math.inf


def demand_of(image: ChipImage, block: int, chip: ChipModel = LOIHI) -> Demand:
    return Demand(image, chip, block, ProfileMasks(image))


@pytest.mark.parametrize(
    ("first", "end", "amounts"),
    [
        (0, 3, (3, 2, 0, 4 * 64)),
        (0, 2, (2, 1, 0, 2 * 64)),  # axon 1 has no target there
        (2, 3, (1, 2, 0, 2 * 64)),
        (1, 2, (1, 1, 0, 1 * 64)),
    ],
)
def test_a_stretch_takes_the_axons_that_reach_it(
    first: int, end: int, amounts: tuple[int, ...]
) -> None:
    image = two_blocks()
    load = demand_of(image, 1).load(first, end, out_slots(image, LOIHI))
    assert load.amounts == amounts


def test_output_axons_of_a_stretch_are_the_sum_of_its_slots() -> None:
    image = two_blocks()
    load = demand_of(image, 0).load(1, 2, np.array([5, 7, 0, 0, 0]))
    assert load.amounts == (1, 0, 7, 0)


@pytest.mark.parametrize(
    ("room", "end"),
    [
        ((3, INF, INF, INF), 3),
        ((2, INF, INF, INF), 2),
        ((INF, 1, INF, INF), 2),
        ((INF, INF, INF, 64), 1),
        ((INF, 0, INF, INF), 0),
    ],
)
@pytest.mark.parametrize("likely", [1, 2, 3, 9])
def test_the_longest_stretch_ends_where_the_room_does(
    room: tuple[float, ...], end: int, likely: int
) -> None:
    image = two_blocks()
    capacity = Capacity(room, (INF,) * 6)
    assert demand_of(image, 1).longest(0, out_slots(image, LOIHI), capacity, likely) == end


def test_an_axon_is_counted_for_each_piece_it_reaches() -> None:
    demand = demand_of(two_blocks(), 1)
    assert {g: n.tolist() for g, n in demand.pieces_reached([0, 2, 3]).items()} == {0: [2, 1]}
    assert demand.pieces_reached([0, 1, 2, 3])[0].tolist() == [3, 1]


def test_an_axon_without_a_base_reaches_no_piece() -> None:
    group = Group([[64, 64]], axon_row=[0, 0], axon_base=[0, -1])
    demand = demand_of(Parts([Block(2)], [group]).image(), 0)
    assert demand.pieces_reached([0, 1, 2])[0].tolist() == [2, 0]


@pytest.mark.slow
@pytest.mark.parametrize("chip", [LOIHI, SOFT], ids=lambda chip: chip.name)
@settings(max_examples=60)
@given(images(), st.randoms(use_true_random=False))
def test_any_piece_takes_the_resources_computed_for_its_stretch(
    chip: ChipModel, image: ChipImage, random: object
) -> None:
    sizes = np.diff(image.blocks.start)
    blocks = [b for b in np.flatnonzero(can_cut(image)).tolist() if sizes[b] > 1]
    assume(blocks)
    block = random.choice(blocks)
    middle = random.randint(1, int(sizes[block]) - 1)
    after = cut(image, {block: [middle]})
    pieces = block_loads(after, chip)[block : block + 2]
    demand, slots = demand_of(image, block, chip), out_slots(after, chip)
    for piece, (first, end) in zip(pieces, [(0, middle), (middle, demand.n)], strict=True):
        found = demand.load(first, end, slots)
        # lists of population axons that compartments share are counted for each of them here
        *same, out_axons, bits = zip(found.amounts, piece.amounts, strict=True)
        assert all(one == other for one, other in (*same, bits))
        assert out_axons[0] >= out_axons[1]
        assert out_axons[0] == out_axons[1] or (image.groups.pop_type != 0).any()
        assert [m.bit_count() for m in found.profiles] == [m.bit_count() for m in piece.profiles]
