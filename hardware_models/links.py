"""The load that messages between cores put on the links of a board."""

from typing import NamedTuple

import numpy as np

from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.topology import chip_of, tile_xy


class Cost(NamedTuple):
    """The cost of messages on their way, with the most important part first.

    Messages between chips, messages on the fullest link between two neighbouring tiles in one
    direction, and hops between tiles.
    """

    between_chips: int
    worst_link: int
    hops: int


class LinkLoads(NamedTuple):
    """The loads of sets of messages, each array with a row for each set.

    Messages between chips, (n,); messages on each link between two tiles in one direction,
    (n, n_links); and hops between tiles, (n,).
    """

    between_chips: np.ndarray
    links: np.ndarray
    hops: np.ndarray


class Links:
    """The links between the tiles that hold the first cores of a board, with XY routing.

    A message moves along the row of its source to the column of its target, then along that column.
    Between chips no route is public: messages are only counted.

    Parameters
    ----------
    n_cores : int
        Cores in use.
    chip : ChipModel
        The chip on the board.
    """

    def __init__(self, n_cores: int, chip: ChipModel) -> None:
        self._xy, self._chip = tile_xy(n_cores, chip), chip_of(n_cores, chip)

    def distances(self) -> np.ndarray:
        """Return the hops (n_cores, n_cores) between cores; cores of other chips are furthest."""
        distance: np.ndarray = np.abs(self._xy[:, np.newaxis] - self._xy).sum(axis=2)
        distance[self._chip[:, np.newaxis] != self._chip] = distance.max() + 1
        return distance

    def cost(self, source: np.ndarray, target: np.ndarray, messages: np.ndarray) -> Cost:
        """Return the cost of messages between cores, each an (n,) array."""
        loads = self.loads(source, target, messages, np.zeros(len(messages), dtype=int), 1)
        return Cost(int(loads.between_chips[0]), int(loads.links.max()), int(loads.hops[0]))

    def loads(
        self, source: np.ndarray, target: np.ndarray, messages: np.ndarray, of: np.ndarray, n: int
    ) -> LinkLoads:
        """Return the loads of each of n sets of messages.

        ``of`` is the number of each message's set, an array like the others. A negative number of
        messages takes messages away.
        """
        near = self._chip[source] == self._chip[target]
        between = _sums(messages[~near], of[~near], n)
        source, target, carried, of = source[near], target[near], messages[near], of[near]
        (x, y), (to_x, to_y), chip = self._xy[source].T, self._xy[target].T, self._chip[source]
        # The lines of tiles, by set and chip: rows first, then columns.
        (n_x, n_y), n_chips = self._xy.max(axis=0) + 1, int(self._chip.max()) + 1
        board = of * n_chips + chip
        rows = _loads(carried, board * n_y + y, n * n_chips * n_y, x, to_x, n_x)
        columns = _loads(carried, board * n_x + to_x, n * n_chips * n_x, y, to_y, n_y)
        hops = _sums(carried * (np.abs(x - to_x) + np.abs(y - to_y)), of, n)
        return LinkLoads(between, np.hstack([rows.reshape(n, -1), columns.reshape(n, -1)]), hops)


def _loads(
    carried: np.ndarray, line: np.ndarray, n_lines: int, start: np.ndarray, end: np.ndarray, n: int
) -> np.ndarray:
    """Return the load of each link of lines of n tiles, in both directions: (n_lines, 2, n)."""
    change = np.zeros(n_lines * 2 * n, dtype=int)
    for way, (low, high) in enumerate([(start, end), (end, start)]):
        on = low < high
        # Messages are added where they enter a line and taken off where they leave it: the running
        # sum along the line is the load of each link, without a loop over links.
        first = (2 * line[on] + way) * n
        np.add.at(change, first + low[on], carried[on])
        np.add.at(change, first + high[on], -carried[on])
    result: np.ndarray = change.reshape(n_lines, 2, n).cumsum(axis=-1)
    return result


def _sums(values: np.ndarray, of: np.ndarray, n: int) -> np.ndarray:
    """Return the sum of the values of each of n sets, (n,)."""
    sums = np.zeros(n, dtype=int)
    np.add.at(sums, of, values)
    return sums
