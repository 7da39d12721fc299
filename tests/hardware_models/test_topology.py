import numpy as np
import pytest

from spikeport.errors import CompileError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.topology import Hops, hops, tile_xy, tiles_used


def test_tiles_lie_column_by_column(chip):
    # cores 0, 1 | 2, 3 | 4, 5 | 6, 7 are on tiles (0, 0) | (0, 1) | (1, 0) | (1, 1)
    assert tile_xy(8, chip).tolist() == [
        [0, 0], [0, 0], [0, 1], [0, 1], [1, 0], [1, 0], [1, 1], [1, 1]
    ]  # fmt: skip


def test_the_last_core_of_loihi_is_in_the_far_corner():
    assert tile_xy(128, chips.get("loihi"))[-1].tolist() == [7, 3]


def test_tiles_used(chip):
    assert [tiles_used(n, chip) for n in (1, 2, 3, 8)] == [1, 1, 2, 4]


def test_hops(chip):
    messages = np.zeros((8, 8), dtype=int)
    messages[0, 1] = 1000  # within a tile: no hop
    messages[0, 2] = 5  # (0, 0) -> (0, 1): 5 north-south
    messages[7, 3] = 7  # (1, 1) -> (0, 1): 7 east-west
    messages[6, 0] = 2  # (1, 1) -> (0, 0): 2 of each
    assert hops(messages, chip) == Hops(east_west=7 + 2, north_south=5 + 2)


def test_cores_beyond_the_mesh(chip):
    with pytest.raises(CompileError) as caught:
        tile_xy(9, chip)
    assert str(caught.value) == (
        "9 cores are in use, but the mesh of chip 'toy' has 8; use fewer or smaller ensembles"
    )
