"""An image as nengo-loihi's model, and its blocks on cores."""

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.model import Placement, model_of
from tests.helpers.fake_board import small_image
from tests.helpers.images import Block, Output, Parts


def test_placements_say_where_blocks_and_compartments_are() -> None:
    image = Parts([Block(2, core=1), Block(3), Block(1, core=1)]).image()
    single, packed = Placement.single(image), Placement.packed(image)
    assert single.is_single
    assert not packed.is_single
    assert [blocks.tolist() for blocks in packed.blocks_of] == [[1], [0, 2]]
    assert single.compartments(image).tolist() == [0, 1, 2, 3, 4, 5]
    assert packed.compartments(image).tolist() == [2, 3, 4, 0, 1, 5]


def test_outputs_are_probes_of_the_blocks_they_read() -> None:
    image = small_image()
    model = model_of(image, Placement.single(image))
    assert [(probe.key, probe.slice) for probe in model.probes] == [
        ("voltage", [[0, 1]]),
        ("spiked", [[0, 1, 2]]),
        ("current", [[0]]),
    ]


@pytest.mark.parametrize(
    ("read", "targets", "slices"),
    [
        ([0, 1, 2, 3, 4], [0, 1], [[0, 1, 2], [0, 1]]),
        ([4, 3, 2, 1, 4], [1, 0, 1], [[1, 0], [2, 1], [1]]),
    ],
)
def test_an_output_whose_segment_lies_in_several_blocks_reads_each(
    read: list[int], targets: list[int], slices: list[list[int]]
) -> None:
    image = Parts([Block(3), Block(2)], outputs=[Output("spiked", read)]).image()
    model = model_of(image, Placement.packed(image))
    (probe,) = model.probes
    assert [model.blocks.index(block) for block in probe.target] == targets
    assert probe.slice == slices


def test_blocks_without_noise_take_the_noise_exponent_of_their_core() -> None:
    blocks = [Block(1, noise_exp=3), Block(2, noise_exp=9, enable_noise=[0, 1]), Block(1, core=1)]
    image = Parts(blocks).image()
    shared = model_of(image, Placement.packed(image)).blocks
    assert [block.compartment.noise_exp for block in shared] == [9, 9, 7]
    alone = model_of(image, Placement.single(image)).blocks
    assert [block.compartment.noise_exp for block in alone] == [3, 9, 7]
    assert np.array_equal(shared[1].compartment.enable_noise, [False, True])
