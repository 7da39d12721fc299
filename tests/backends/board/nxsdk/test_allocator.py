"""Allocation of blocks to the cores of a placement, on as many chips as it needs."""

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.allocator import CORES_PER_CHIP, Allocator, n_chips
from spikeport.backends.board.nxsdk.model import Placement, model_of
from spikeport.errors import BackendError
from tests.helpers.images import Block, Parts

IMAGE = Parts([Block(1, core=1, vth=64), Block(1, vth=64), Block(1, core=1, vth=128)]).image()


def test_blocks_lie_on_the_cores_of_their_placement_and_share_profiles() -> None:
    placement = Placement.packed(IMAGE)
    model = model_of(IMAGE, placement)
    board = Allocator(placement)(model, 1)
    cores = board.chips[0].cores
    first, second, third = model.blocks
    assert [core.blocks for core in cores] == [[second], [first, third]]
    assert [len(core.vth_cfgs) for core in cores] == [1, 2]
    assert [len(core.compartment_cfgs) for core in cores] == [1, 1]


def test_a_core_without_blocks_stays_empty() -> None:
    placement = Placement("gaps", np.array([0, 2, 2]))
    board = Allocator(placement)(model_of(IMAGE, placement), 1)
    assert [len(core.blocks) for core in board.chips[0].cores] == [1, 0, 2]


def test_cores_beyond_a_chip_lie_on_the_next_chip() -> None:
    placement = Placement("far", np.array([0, 1, CORES_PER_CHIP]))
    assert n_chips(placement) == 2
    board = Allocator(placement)(model_of(IMAGE, placement), 2)
    assert [len(chip.cores) for chip in board.chips] == [CORES_PER_CHIP, 1]
    with pytest.raises(BackendError, match="placement on 129 cores; the board has 1 chips of 128"):
        Allocator(placement)(model_of(IMAGE, placement), 1)
