"""Constants and state of the kernels."""

import numpy as np
import pytest

from spikeport.backends.native.loaded import STRETCH, neurons_of, resting_state
from spikeport.backends.native.wiring import LANES, wire
from tests.helpers.images import Block, Group, Output, Parts, Route


def test_decays_are_stored_as_the_part_that_is_kept() -> None:
    neurons = neurons_of(Parts([Block(2, decay_u=[4095, 0], decay_v=[0, 4096])]).image())
    assert neurons.keep_u.tolist() == [0, 4095]
    assert neurons.keep_v.tolist() == [4096, 0]


def test_blocks_with_a_bias_throughout_are_always_active() -> None:
    image = Parts([Block(2, bias=[1, 0]), Block(3, core=1, bias=7)]).image()
    assert neurons_of(image).block.tolist() == [[0, 2, 0, 0], [2, 5, 1, 1]]


def test_outputs_are_read_as_pairs_of_compartment_and_key() -> None:
    outputs = [Output("spiked", [1, 0]), Output("current", [2])]
    image = Parts([Block(3)], outputs=outputs).image()
    assert neurons_of(image).read.tolist() == [[1, 2], [0, 2], [2, 1]]


def test_stretches_end_where_clipping_changes_and_have_a_largest_size() -> None:
    blocks = [Block(3), Block(2), Block(STRETCH + 1, vmin=0, vmax=511)]
    low, high = -(2**23) + 1, 2**23 - 1
    assert neurons_of(Parts(blocks).image()).stretch.tolist() == [
        [0, 5, low, high],
        [5, STRETCH, 0, 511],
        [STRETCH, STRETCH + 6, 0, 511],
    ]


@pytest.mark.parametrize(("weight", "dtype"), [(64, np.int16), (32, np.int32)])
def test_sums_have_16_bits_only_if_all_weights_are_multiples_of_64(
    weight: int, dtype: type
) -> None:
    image = Parts([Block(5)], [Group([[weight] * 5])], [2], [Route([0, 0], input=0)]).image()
    state = resting_state(image, wire(image))
    assert state.sums.dtype == dtype
    assert state.sums.shape == state.v.shape == (5,)
    assert len(state.pending) == 2
    assert not any(array.any() for array in state)


def test_sums_begin_with_a_cache_line_and_have_room_behind() -> None:
    image = Parts([Block(40)]).image()
    sums = resting_state(image, wire(image)).sums
    assert sums.ctypes.data % 64 == 0
    assert isinstance(sums.base, np.ndarray)
    behind = sums.base.ctypes.data + sums.base.nbytes - sums.ctypes.data - sums.nbytes
    assert behind >= 2 * LANES * sums.itemsize
