"""Settling of packings: blocks move or swap onto the core that they share most spikes with."""

from collections.abc import Iterable
from itertools import accumulate

import numpy as np

from spikeport.compile.placing.core_traffic import CoreTraffic
from spikeport.compile.placing.gains import Gains
from spikeport.compile.placing.load import Load
from spikeport.compile.placing.problem import Bins, Problem


def settled(problem: Problem, bins: Bins) -> Bins:
    """Move or swap blocks onto the core they share most spikes with, until no block can be.

    The number of spikes within cores rises with every move, so the moves end. The number of cores
    does not rise, and every core that had room for its blocks still has.

    Parameters
    ----------
    problem : Problem
        The blocks.
    bins : Bins
        A packing of them, which is not changed.
    """
    settling = Settling(problem, bins)
    moved = [True]
    # A block may be able to move once others have moved, so all are tried until none moves.
    while any(moved):
        moved = [settling.settle(block) for block in range(len(problem.loads))]
    return [blocks for blocks in settling.bins if blocks]


class Settling:
    """A packing while its blocks move.

    Attributes
    ----------
    bins : Bins
        The blocks of each core; a core that is emptied stays, without blocks.
    """

    def __init__(self, problem: Problem, bins: Bins) -> None:
        self._problem = problem
        self.bins = [list(blocks) for blocks in bins]
        number: dict[Load, int] = {}
        self._kinds = [number.setdefault(load, len(number)) for load in problem.loads]
        self._traffic = CoreTraffic(problem, bins)
        self._core = self._traffic.core
        self._gains = Gains(problem.traffic, self.bins)
        # The number of moves, when each core last changed, and when each block last stayed.
        self._n_moves = 1
        self._changed = [1] * len(bins)
        self._stayed = [0] * len(problem.loads)
        self._loads: dict[int, Load] = {}
        self._rests: dict[int, dict[int, Load]] = {}

    def settle(self, block: int) -> bool:
        """Move or swap a block if this brings more spikes within cores; return whether it moved."""
        home, spikes = self._core[block], self._traffic.spikes(block)
        # If neither its own core nor a core that it shares spikes with has changed, it stays again.
        if max(self._changed[core] for core in (home, *spikes)) <= self._stayed[block]:
            return False
        now = spikes.get(home, 0)
        better = sorted((-n, core) for core, n in spikes.items() if n > now)
        if any(self._moved(block, core) for _, core in better):
            return True
        self._stayed[block] = self._n_moves
        return False

    def _moved(self, block: int, core: int) -> bool:
        """Move a block to a core, or swap it with a block there; return whether it moved."""
        home = self._core[block]
        if self._problem.room.holds(self._load(core).joined(self._problem.loads[block])):
            left = [b for b in self.bins[home] if b != block]
            self._set(home, left)
            self._set(core, [*self.bins[core], block])
            return True
        return self._swapped(block, core)

    def _swapped(self, block: int, core: int) -> bool:
        """Swap a block with one of a core if both fit and this brings more spikes within cores."""
        # Images have many equal blocks: if one does not fit, equal blocks do not.
        of_kind = {self._kinds[other]: other for other in self.bins[core]}
        fitting = {kind for kind, other in of_kind.items() if self._fit_swapped(block, other)}
        if not fitting:  # as on most cores: their gains need not be counted
            return False
        gains = self._gains.of(block, self._core[block], core)
        for other in (self.bins[core][i] for i in np.flatnonzero(gains > 0)):
            if self._kinds[other] in fitting:
                self._swap(block, other)
                return True
        return False

    def _fit_swapped(self, block: int, other: int) -> bool:
        """Return whether two blocks each fit on the core of the other, in its place."""
        home, there = self._core[block], self._core[other]
        loads, holds = self._problem.loads, self._problem.room.holds
        return holds(self._rest(there)[other].joined(loads[block])) and holds(
            self._rest(home)[block].joined(loads[other])
        )

    def _swap(self, block: int, other: int) -> None:
        home, there = self._core[block], self._core[other]
        left = [b for b in self.bins[home] if b != block]
        rest = [b for b in self.bins[there] if b != other]
        self._set(home, [*left, other])
        self._set(there, [*rest, block])

    def _set(self, core: int, blocks: list[int]) -> None:
        """Give a core other blocks."""
        self.bins[core] = blocks
        self._gains.put(core, blocks)
        for block in blocks:
            self._traffic.move(block, core)
        self._n_moves += 1
        self._changed[core] = self._n_moves
        self._loads.pop(core, None)
        self._rests.pop(core, None)

    def _load(self, core: int) -> Load:
        """Return the load of a core."""
        if core not in self._loads:
            self._loads[core] = self._problem.load(self.bins[core])
        return self._loads[core]

    def _rest(self, core: int) -> dict[int, Load]:
        """Return, for each block of a core, the load of the core without this block."""
        if core not in self._rests:
            blocks = self.bins[core]
            loads = [self._problem.loads[block] for block in blocks]
            # Sums before a block and after it: united profiles cannot be subtracted.
            before, after = _sums(loads), _sums(reversed(loads))[::-1]
            rests = (a.joined(b) for a, b in zip(before[:-1], after[1:], strict=True))
            self._rests[core] = dict(zip(blocks, rests, strict=True))
        return self._rests[core]


def _sums(loads: Iterable[Load]) -> list[Load]:
    """Return the load of the first 0, 1, ... of several loads together."""
    return list(accumulate(loads, Load.joined, initial=Load()))
