"""The places of cores on the meshes of a board's chips, and the routes of messages there.

    chip = core // cores of a chip

The connections of chips are not public: messages between them are counted, not routed.
"""

from typing import NamedTuple

import numpy as np

from spikeport.arrays import Flags
from spikeport.errors import CompileError
from spikeport.hardware_models.chip import ChipModel


class Hops(NamedTuple):
    """Hops between tiles, by direction, each (n_cores,), of the messages that each core sends."""

    east_west: np.ndarray
    north_south: np.ndarray


def chip_of(n_cores: int, chip: ChipModel) -> np.ndarray:
    """Return the numbers (n_cores,) of the chips that cores lie on."""
    return np.arange(n_cores) // chip.limits.cores.count


def chips_used(n_cores: int, chip: ChipModel) -> int:
    """Return the number of chips that hold the first ``n_cores`` cores."""
    return -(-n_cores // chip.limits.cores.count)


def tile_xy(n_cores: int, chip: ChipModel) -> np.ndarray:
    """Return the position of each core's tile on the mesh of its chip.

        tile = core // cores_per_tile,   x = tile // tiles_y,   y = tile % tiles_y

    Parameters
    ----------
    n_cores : int
        Cores in use: the first ones of the board.
    chip : ChipModel
        The chip with the meshes.

    Returns
    -------
    xy : (n_cores, 2) int array
        Column x, from west to east, and row y of each core; all 0 where the mesh is not public.

    Raises
    ------
    CompileError
        The meshes have fewer cores.

    Source: the order of cores and tiles is that of SANA-FE (src/arch.cpp).
    """
    mesh = chip.topology
    if mesh is None:
        return np.zeros((n_cores, 2), dtype=int)
    if n_cores > chip.n_cores:
        raise CompileError(
            f"{n_cores} cores are in use, but the mesh of chip '{chip.name}' has "
            f"{chip.n_cores}; use fewer or smaller ensembles"
        )
    tile = np.arange(n_cores) % chip.limits.cores.count // mesh.cores_per_tile.count
    return np.stack(np.divmod(tile, mesh.tiles_y.count), axis=1)


def tiles_used(n_cores: int, chip: ChipModel) -> int:
    """Return the number of tiles that hold the first ``n_cores`` cores."""
    places = np.column_stack([chip_of(n_cores, chip), tile_xy(n_cores, chip)])
    return len(np.unique(places, axis=0))


def hops(messages: np.ndarray, chip: ChipModel) -> Hops:
    """Return the hops of messages between tiles of a chip, with XY routing; 0 within a tile.

        H_ew,i = sum_j M_ij |x_i - x_j|,   H_ns,i = sum_j M_ij |y_i - y_j|

    Messages from the host and between chips have no public route: their hops are not counted.

    Parameters
    ----------
    messages : (n_cores, n_cores) array
        Messages from core i to core j.
    chip : ChipModel
        The chip with the mesh.
    """
    xy = tile_xy(len(messages), chip)
    distance = np.abs(xy[:, np.newaxis] - xy)  # (n_cores, n_cores, 2)
    return Hops(*np.einsum("ij,ijd->di", messages * _same_chip(messages, chip), distance))


def messages_between_chips(messages: np.ndarray, chip: ChipModel) -> np.ndarray:
    """Return the messages (n_cores,) of an array (n_cores, n_cores) that leave a core's chip."""
    leaving: np.ndarray = (messages * ~_same_chip(messages, chip)).sum(axis=1)
    return leaving


def _same_chip(messages: np.ndarray, chip: ChipModel) -> Flags:
    number = chip_of(len(messages), chip)
    same: Flags = number[:, np.newaxis] == number
    return same
