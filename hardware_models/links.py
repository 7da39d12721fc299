"""What messages between cores ask of the links of a board."""

from typing import NamedTuple

import numpy as np

from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.topology import chip_of, tile_xy


class Cost(NamedTuple):
    """What messages cost on their way, the more important first.

    Messages between chips, messages on the fullest link between two neighbouring tiles in one
    direction, and hops between tiles.
    """

    between_chips: int
    worst_link: int
    hops: int


class Links:
    """The links between the tiles that hold the first cores of a board, with XY routing.

    A message moves along the row of its source to the column of its target, then along that column.
    Between chips no route is public: there messages are counted alone.

    Parameters
    ----------
    n_cores : int
        Cores in use.
    chip : ChipModel
        Whose board it is.
    """

    def __init__(self, n_cores: int, chip: ChipModel) -> None:
        self._xy, self._chip = tile_xy(n_cores, chip), chip_of(n_cores, chip)

    def distances(self) -> np.ndarray:
        """(n_cores, n_cores) hops between cores; another chip is further than any on one."""
        distance: np.ndarray = np.abs(self._xy[:, np.newaxis] - self._xy).sum(axis=2)
        distance[self._chip[:, np.newaxis] != self._chip] = distance.max() + 1
        return distance

    def cost(self, source: np.ndarray, target: np.ndarray, messages: np.ndarray) -> Cost:
        """What messages cost between cores, each an (n,) array."""
        near = self._chip[source] == self._chip[target]
        source, target, carried = source[near], target[near], messages[near]
        (x, y), (to_x, to_y), board = self._xy[source].T, self._xy[target].T, self._chip[source]
        return Cost(
            int(messages[~near].sum()),
            max(_most(carried, (board, y), x, to_x), _most(carried, (board, to_x), y, to_y)),
            int(carried @ (np.abs(x - to_x) + np.abs(y - to_y))),
        )


def _most(
    carried: np.ndarray, line: tuple[np.ndarray, np.ndarray], start: np.ndarray, end: np.ndarray
) -> int:
    """The fullest link of all lines of tiles that messages move along, from start to end."""
    shape = [int(part.max(initial=0)) + 1 for part in (*line, np.append(start, end))]
    loads = np.zeros((2, *shape), dtype=int)  # links towards higher and lower places
    for way, (low, high) in enumerate([(start, end), (end, start)]):
        on = low < high
        for at, sign in ((low, 1), (high, -1)):
            np.add.at(loads[way], (line[0][on], line[1][on], at[on]), sign * carried[on])
    return int(loads.cumsum(axis=-1).max(initial=0))
