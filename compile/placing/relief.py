"""Swaps of the busiest cores that relieve links of a board."""

from typing import NamedTuple

import numpy as np

from spikeport.compile.image.tables import offsets, part, ranges
from spikeport.hardware_models.links import LinkLoads, Links

BUSIEST = 16
"""The number of cores, by messages, that are swapped to relieve links."""
TOGETHER = 256
"""The number of swaps whose costs are counted together: the loads of all links, for each of them,
are in memory at once."""


class Messages(NamedTuple):
    """Messages between cores, arrays of (n,): from core to core, and how many."""

    source: np.ndarray
    target: np.ndarray
    number: np.ndarray


class Relief:
    """The swaps of one core with others that lower the cost of all messages.

    Parameters
    ----------
    messages : Messages
        The messages between cores; messages within a core are left out.
    links : Links
        The links of the board.
    n_cores : int
        The number of cores.
    """

    def __init__(self, messages: Messages, links: Links, n_cores: int) -> None:
        between = messages.source != messages.target
        self._messages = Messages(*(array[between] for array in messages))
        self._links = links
        ends = np.concatenate(self._messages[:2])
        self._start = offsets(np.bincount(ends, minlength=n_cores))
        # Messages by core, as sender or receiver: `ends` lists every message twice.
        self._of_core = np.argsort(ends, kind="stable") % max(between.sum(), 1)
        self._busiest = np.argsort(-self._sums(ends, n_cores), kind="stable")[:BUSIEST]

    def relieved(self, order: np.ndarray) -> np.ndarray:
        """Swap each of the busiest cores with every other where that lowers the cost.

        ``order`` (n_cores,) holds the core of each place, as does the result.
        """
        order = order.copy()
        for core in self._busiest:
            after = 0
            while (place := self._first_better(order, core, after)) is not None:
                here = np.flatnonzero(order == core)[0]
                order[[here, place]] = order[[place, here]]
                # Earlier places were tried with this core already, and are not tried again.
                after = place + 1
        return order

    def _sums(self, ends: np.ndarray, n_cores: int) -> np.ndarray:
        """Return the messages that each core sends and receives, (n_cores,)."""
        sums = np.zeros(n_cores, dtype=int)
        np.add.at(sums, ends, np.tile(self._messages.number, 2))
        return sums

    def _first_better(self, order: np.ndarray, core: int, after: int) -> int | None:
        """Return the first place, from ``after`` on, whose core lowers the cost if swapped."""
        place = np.argsort(order)
        source, target, number = self._messages
        now = self._links.loads(place[source], place[target], number, np.zeros_like(number), 1)
        for first in range(after, len(order), TOGETHER):
            places = np.arange(first, min(first + TOGETHER, len(order)))
            better = _lower(now, self._changes(place, core, order[places], places))
            if better.any():
                return first + int(better.argmax())
        return None

    def _changes(
        self, place: np.ndarray, core: int, others: np.ndarray, places: np.ndarray
    ) -> LinkLoads:
        """Return the changes in loads if a core swaps with each of ``others``, on ``places``."""
        swap, message = self._touched(core, others)
        ends = self._messages.source[message], self._messages.target[message]
        number = self._messages.number[message]
        before = [place[end] for end in ends]
        after = [
            np.where(end == core, places[swap], np.where(end == others[swap], place[core], at))
            for end, at in zip(ends, before, strict=True)
        ]
        source, target = (np.concatenate(both) for both in zip(after, before, strict=True))
        signed = np.concatenate([number, -number])
        return self._links.loads(source, target, signed, np.tile(swap, 2), len(places))

    def _touched(self, core: int, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the messages that each swap moves, each once: the swap's and message's number."""
        ours = self._of_core[part(self._start, core)]
        sizes = np.diff(self._start)[others]
        theirs = self._of_core[ranges(self._start[others], sizes)]
        swap = np.repeat(np.arange(len(others)), sizes)
        twice = (self._messages.source[theirs] == core) | (self._messages.target[theirs] == core)
        swaps = np.repeat(np.arange(len(others)), len(ours)), swap[~twice]
        return np.concatenate(swaps), np.concatenate([np.tile(ours, len(others)), theirs[~twice]])


def _lower(now: LinkLoads, change: LinkLoads) -> np.ndarray:
    """Return which changes lower the cost, (n,) of bool, compared in the order of `Cost`."""
    worst = (now.links + change.links).max(axis=1)
    differences = (change.between_chips, worst - now.links.max(), change.hops)
    lower, equal = np.zeros(len(worst), dtype=bool), np.ones(len(worst), dtype=bool)
    for difference in differences:
        lower |= equal & (difference < 0)
        equal &= difference == 0
    return lower
