"""Emptying of cores in a packing: their blocks move to cores with room, or push smaller blocks."""

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from spikeport.compile.placing.cores import Cores
from spikeport.compile.placing.exchange import Exchanges
from spikeport.compile.placing.load import Load
from spikeport.compile.placing.problem import Bins, Problem

EXCHANGES = 300_000
"""The most exchanges of blocks that emptying tries. Each takes time in proportion to the number of
blocks on a core, and the number of exchanges grows with the square of the number of blocks. A chain
of 500 small ensembles took 170,000 in four packings."""


class Emptying:
    """The attempts to empty cores of a packing, each undone unless it succeeds.

    Attributes
    ----------
    left : int
        The number of exchanges that may still be tried.
    """

    def __init__(self, problem: Problem, bins: Bins, left: int) -> None:
        self._problem = problem
        self._cores = Cores(problem, bins)
        self._exchanges = Exchanges(problem.loads, problem.room, self._cores.tally)
        for core, blocks in enumerate(bins):
            self._exchanges.put(core, blocks)
        self._fills = np.array(problem.fills)
        # Attempts change few cores, so the cores that had room before are found once for each load.
        self._had_room = {
            load: self._cores.tally.with_room(load).tolist() for load in set(problem.loads)
        }
        self._before: dict[int, tuple[list[int], Load]] = {}
        self._victim = -1
        self.left = left

    def without(self, victim: int) -> Bins | None:
        """Return the packing with one core's blocks on other cores; None if they find no room."""
        self._victim, self._before = victim, {}
        # The largest block first, while there is most room.
        blocks = sorted(self._cores.bins[victim], key=lambda b: -self._problem.fills[b])
        if all(self._take(block) for block in blocks):
            return [mine for core, mine in enumerate(self._cores.bins) if core != victim]
        for core, (mine, load) in self._before.items():
            self._put(core, mine, load)
        self._exchanges.put(victim, self._cores.bins[victim])
        return None

    def by_fill(self) -> list[int]:
        """Return the cores, the emptiest first."""
        loads = self._cores.loads
        return sorted(range(len(loads)), key=lambda core: self._problem.room.fill(loads[core]))

    def _take(self, block: int) -> bool:
        """Place a block, if need be where a smaller one makes room; return whether it is placed."""
        return self._place(block) or any(
            self._push(core, other, block) for core, other in self._may_make_room(block)
        )

    def _may_make_room(self, block: int) -> Iterator[tuple[int, int]]:
        """Yield the smaller blocks that may give their place to a block, each with its core."""
        smaller = np.flatnonzero(self._fills < self._fills[block])
        possible = self._exchanges.possible(self._problem.loads[block], smaller)
        at: dict[int, set[int]] = defaultdict(set)
        for core, other in zip(
            self._exchanges.core_of(possible).tolist(), possible.tolist(), strict=True
        ):
            at[core].add(other)
        # Blocks of the core that is being emptied have no place to give.
        at.pop(self._victim, None)
        for core in sorted(at):
            kinds = set()
            for other in self._cores.bins[core]:
                # Images have many equal blocks: if one makes no room, equal blocks make none.
                if other in at[core] and (kind := self._problem.loads[other]) not in kinds:
                    kinds.add(kind)
                    yield core, other

    def _place(self, block: int, but: int = -1) -> bool:
        """Put a block on the core that is fullest with it; return whether any core has room."""
        room = self._room_for(block, but)
        if len(room):
            # The fullest core, so that room for large blocks stays together elsewhere.
            best = int(room[np.argmax(self._cores.fills(block, room))])
            load = self._cores.loads[best].joined(self._problem.loads[block])
            self._set(best, [*self._cores.bins[best], block], load)
        return bool(len(room))

    def _room_for(self, block: int, but: int) -> np.ndarray:
        """Return the cores with room for a block, except ``but`` and the core being emptied."""
        room = self._cores.with_room(block)
        others: np.ndarray = room[(room != but) & (room != self._victim)]
        return others

    def _third_has_room(self, core: int, other: int) -> bool:
        """Return whether a third core has room for a block of a core."""
        load, room = self._problem.loads[other], self._problem.room
        out = core, self._victim
        return any(
            third not in out and third not in self._before for third in self._had_room[load]
        ) or any(
            third not in out and room.holds(self._cores.loads[third].joined(load))
            for third in self._before
        )

    def _push(self, core: int, other: int, block: int) -> bool:
        """Put a block in the place of another, which goes to a third core; return whether both fit.

        If they do not, nothing changes.
        """
        if not self.left:
            return False
        self.left -= 1
        # Checked before the load is added up, which takes longer: mostly no core has room.
        if not self._third_has_room(core, other):
            return False
        blocks = [*(b for b in self._cores.bins[core] if b != other), block]
        load = self._problem.load(blocks)
        if not self._problem.room.holds(load) or not self._place(other, but=core):
            return False
        self._set(core, blocks, load)
        return True

    def _set(self, core: int, blocks: list[int], load: Load) -> None:
        # Only the state before the first change is kept: a failed attempt goes back to it.
        self._before.setdefault(core, (self._cores.bins[core], self._cores.loads[core]))
        self._put(core, blocks, load)

    def _put(self, core: int, blocks: list[int], load: Load) -> None:
        self._cores.set(core, blocks, load)
        self._exchanges.put(core, blocks)


def emptied(problem: Problem, bins: Bins, exchanges: int = EXCHANGES) -> Bins:
    """Empty one core after another while their blocks find room elsewhere.

    Parameters
    ----------
    problem : Problem
        The blocks.
    bins : Bins
        A packing of them, which is not changed.
    exchanges : int
        The most attempts, in all, to put a block in the place of another.
    """
    while True:
        emptying = Emptying(problem, bins, exchanges)
        fewer = _with_one_emptied(problem, bins, emptying)
        exchanges = emptying.left
        if fewer is None:
            return bins
        bins = fewer


def _with_one_emptied(problem: Problem, bins: Bins, emptying: Emptying) -> Bins | None:
    """Empty the emptiest core that can be emptied; return None if no core can."""
    tried = set()
    for victim in emptying.by_fill():
        # Images have many equal blocks: if a core's blocks found no room, equal blocks find none.
        loads = tuple(sorted(problem.loads[block] for block in bins[victim]))
        if loads in tried:
            continue
        tried.add(loads)
        if (fewer := emptying.without(victim)) is not None:
            return fewer
    return None
