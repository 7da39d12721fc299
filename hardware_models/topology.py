"""Where cores lie on the chip's mesh of tiles, and how many hops messages take between them."""

from typing import NamedTuple

import numpy as np

from spikeport.errors import CompileError
from spikeport.hardware_models.chip import Chip


class Hops(NamedTuple):
    """Hops between tiles, by direction."""

    east_west: int
    north_south: int


def tile_xy(n_cores: int, chip: Chip) -> np.ndarray:
    """Position of each core's tile on the mesh.

        tile = core // cores_per_tile,   x = tile // tiles_y,   y = tile % tiles_y

    Parameters
    ----------
    n_cores : int
        Cores in use: the first ones of the chip.
    chip : Chip
        Whose mesh it is.

    Returns
    -------
    xy : (n_cores, 2) int array
        Column x, from west to east, and row y of each core.

    Raises
    ------
    CompileError
        The mesh has fewer cores.

    Source: the order of cores and tiles is that of SANA-FE (src/arch.cpp).
    """
    mesh = chip.topology
    n_tiles = mesh.tiles_x.count * mesh.tiles_y.count
    if n_cores > n_tiles * mesh.cores_per_tile.count:
        raise CompileError(
            f"{n_cores} cores are in use, but the mesh of chip '{chip.name}' has "
            f"{n_tiles * mesh.cores_per_tile.count}; use fewer or smaller ensembles"
        )
    tile = np.arange(n_cores) // mesh.cores_per_tile.count
    return np.stack(np.divmod(tile, mesh.tiles_y.count), axis=1)


def tiles_used(n_cores: int, chip: Chip) -> int:
    """Number of tiles that hold the first ``n_cores`` cores."""
    return len(np.unique(tile_xy(n_cores, chip), axis=0))


def hops(messages: np.ndarray, chip: Chip) -> Hops:
    """Hops that messages take between tiles with XY routing; none within a tile.

        H_ew = sum_ij M_ij |x_i - x_j|,   H_ns = sum_ij M_ij |y_i - y_j|

    Messages from the host have no public route across the mesh: their hops are not counted.

    Parameters
    ----------
    messages : (n_cores, n_cores) int array
        Messages from core i to core j.
    chip : Chip
        Whose mesh it is.
    """
    xy = tile_xy(len(messages), chip)
    distance = np.abs(xy[:, np.newaxis] - xy)  # (n_cores, n_cores, 2)
    east_west, north_south = np.tensordot(messages, distance, axes=2)
    return Hops(int(east_west), int(north_south))
