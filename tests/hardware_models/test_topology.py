import numpy as np
import pytest

from spikeport.errors import CompileError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.topology import (
    Hops,
    chip_of,
    hops,
    messages_between_chips,
    tile_xy,
    tiles_used,
)


def test_tiles_lie_column_by_column(chip):
    # cores 0, 1 | 2, 3 | 4, 5 | 6, 7 are on tiles (0, 0) | (0, 1) | (1, 0) | (1, 1)
    assert tile_xy(8, chip).tolist() == [
        [0, 0], [0, 0], [0, 1], [0, 1], [1, 0], [1, 0], [1, 1], [1, 1]
    ]  # fmt: skip


def test_the_last_core_of_loihi_is_in_the_far_corner():
    assert tile_xy(128, chips.get("loihi"))[-1].tolist() == [7, 3]


def test_cores_use_as_many_tiles_as_they_need(chip):
    assert [tiles_used(n, chip) for n in (1, 2, 3, 8)] == [1, 1, 2, 4]


def test_hops_are_counted_at_the_sender_in_both_directions(chip):
    messages = np.zeros((8, 8), dtype=int)
    messages[0, 1] = 1000  # within a tile: no hop
    messages[0, 2] = 5  # (0, 0) -> (0, 1): 5 north-south
    messages[7, 3] = 7  # (1, 1) -> (0, 1): 7 east-west
    messages[6, 0] = 2  # (1, 1) -> (0, 0): 2 of each
    found = Hops(*(direction.tolist() for direction in hops(messages, chip)))
    assert found == Hops(east_west=[0] * 6 + [2, 7], north_south=[5] + [0] * 5 + [2, 0])


def test_a_mesh_that_is_not_public_has_no_hops(data):
    chip = ChipModel.model_validate({**data, "topology": None})
    assert not np.any(hops(np.ones((9, 9), dtype=int), chip))
    assert tiles_used(5, chip) == 1


def test_cores_beyond_the_mesh_are_refused(chip):
    with pytest.raises(CompileError) as caught:
        tile_xy(9, chip)
    assert str(caught.value) == (
        "9 cores are in use, but the mesh of chip 'toy' has 8; use fewer or smaller ensembles"
    )


def board(chip, n_chips):
    chips_ = chip.limits.chips.model_copy(update={"value": float(n_chips)})
    return chip.model_copy(update={"limits": chip.limits.model_copy(update={"chips": chips_})})


def test_the_cores_of_a_second_chip_lie_on_a_mesh_of_their_own(chip):
    two = board(chip, 2)
    assert chip_of(16, two).tolist() == [0] * 8 + [1] * 8
    assert tile_xy(16, two)[8:].tolist() == tile_xy(8, chip).tolist()
    assert tiles_used(10, two) == 4 + 1
    with pytest.raises(CompileError, match=r"^17 cores are in use, .* has 16;"):
        tile_xy(17, two)


def test_chips_with_fewer_cores_than_their_mesh_end_with_their_last_core(chip):
    cores = chip.limits.cores.model_copy(update={"value": 3.0})
    limits = chip.limits.model_copy(update={"cores": cores})
    two = board(chip.model_copy(update={"limits": limits}), 2)
    assert chip_of(6, two).tolist() == [0, 0, 0, 1, 1, 1]
    assert tile_xy(6, two).tolist() == [[0, 0], [0, 0], [0, 1]] * 2


def test_messages_between_chips_are_counted_and_have_no_hops(chip):
    messages = np.zeros((16, 16), dtype=int)
    messages[0, 15], messages[9, 3], messages[1, 2] = 4, 3, 1
    two = board(chip, 2)
    assert messages_between_chips(messages, two).tolist() == [4] + [0] * 8 + [3] + [0] * 6
    assert sum(int(direction.sum()) for direction in hops(messages, two)) == 1
