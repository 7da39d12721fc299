import math

import numpy as np
import pytest
from images import Block, Group, Parts, Route

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.placing.load import Capacity
from spikeport.compile.placing.search import Search
from spikeport.hardware_models import chip as chips


def room(
    compartments: float = math.inf, out_axons: float = math.inf, synapses: float = math.inf
) -> Capacity:
    """A core that is limited in these; a synapse of the images here takes a word of 64 bits."""
    return Capacity((compartments, math.inf, out_axons, 64 * synapses), (math.inf,) * 6)


def bounds(image: ChipImage, of: Capacity) -> dict[int, list[int]]:
    return Search(image, chips.get("loihi")).bounds(of)


def dense() -> ChipImage:
    """Six neurons, each with a row of different weights to all eight of a second block."""
    group = Group(list(64 * np.arange(1, 49).reshape(6, 8)), block=1)
    return Parts([Block(6), Block(8)], [group], routes=[Route(range(6), block=0)]).image()


@pytest.mark.parametrize(
    ("of", "expected"),
    [
        (room(), {}),
        (room(compartments=5), {0: [0, 5, 6], 1: [0, 5, 8]}),
        (room(synapses=36), {1: [0, 6, 8]}),
        # A target in two pieces takes two output axons of each of its sources.
        (room(synapses=36, out_axons=8), {0: [0, 4, 6], 1: [0, 6, 8]}),
        (room(synapses=5), {}),  # one compartment alone takes six
    ],
)
def test_pieces_are_as_long_as_there_is_room_for(
    of: Capacity, expected: dict[int, list[int]]
) -> None:
    assert bounds(dense(), of) == expected


def test_axons_of_the_host_take_no_room() -> None:
    group = Group([[64] * 6])
    image = Parts([Block(6)], [group], inputs=[9], routes=[Route([0] * 9, input=0)]).image()
    assert bounds(image, room(compartments=4, out_axons=1)) == {0: [0, 4, 6]}


def test_room_once_taken_is_not_given_back() -> None:
    """The first axon has targets on both sides of 4, but not of 3: cuts would alternate."""
    group = Group([[64, 64], *[[64]] * 5], axon_base=[3, 1, 2, 3, 4, 5])
    image = Parts([Block(6)], [group], routes=[Route(range(6), block=0)]).image()
    assert bounds(image, room(compartments=4, out_axons=4)) == {0: [0, 3, 6]}
