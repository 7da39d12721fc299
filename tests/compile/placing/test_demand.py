import itertools
from dataclasses import replace

import numpy as np
from images import Block, Group, Parts, Route

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.usage import out_slots
from spikeport.compile.placing.cut import cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import ProfileMasks, block_loads
from spikeport.hardware_models import chip as chips

CHIP = chips.get("loihi")
ENDS = [0, 3, 4, 8]


def image_of(*groups: Group) -> ChipImage:
    """Groups of a block of 8, each stored in a format of its own, behind one that sends to it."""
    blocks = [Block(4), Block(8, vth=np.repeat([2**14, 2**15], 4), enable_noise=[1, *[0] * 7])]
    routes = [
        Route(np.resize(range(len(group.axon_row)), 4), block=0, group=g)
        for g, group in enumerate(groups)
    ]
    image = Parts(blocks, list(groups), routes=routes).image()
    form = image.groups.format.copy()
    form[:, image.manifest.synapse_format.index("weight_bits")] -= np.arange(len(groups))
    return replace(image, groups=replace(image.groups, format=form))


def demand_of(image: ChipImage) -> Demand:
    return Demand(image, CHIP, 1, ProfileMasks(image))


def test_demands_are_what_pieces_take() -> None:
    """Axons share rows, have no base or reach the first piece alone; formats differ."""
    shared = Group([[64] * 8, [64]], axon_row=[0, 1, 0, 1], axon_base=[0, 3, 0, -1], block=1)
    image = image_of(shared, Group([[64] * 3], block=1), Group([[64] * 2], axon_base=[6], block=1))
    slots, demand = out_slots(image, CHIP), demand_of(image)
    found = [demand.load(first, end, slots) for first, end in itertools.pairwise(ENDS)]
    assert found == block_loads(cut(image, {1: ENDS[1:-1]}), CHIP)[1:]


def test_pieces_reached_are_counted_by_axon() -> None:
    group = Group([[64] * 8, [64]], axon_row=[1, 0, 0, 1, 1], axon_base=[0, 0, 0, 3, -1], block=1)
    reached = demand_of(image_of(group)).pieces_reached(ENDS)
    assert reached[0].tolist() == [1, 3, 3, 1, 0]
