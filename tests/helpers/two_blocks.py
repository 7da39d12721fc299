"""An image small enough to follow by hand."""

from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route


def two_blocks() -> ChipImage:
    """Return an image of two compartments that send to three, and one source on the host.

    Axon 0 reads weights 64, 128 and 192 onto all three, axon 1 reads 320 onto the last; compartment
    i sends to axon i, the host to axon 1.
    """
    group = Group([[64, 128, 192], [320]], [[[0, 1, 2]], [[2]]], block=1)
    routes = [Route([0, 1], block=0), Route([1], input=0)]
    return Parts([Block(2), Block(3, core=1)], [group], [1], routes).image()
