"""Blocks onto as few cores as can be found, and those that send to each other onto the same one.

This is bin packing with several amounts and with shared profiles, which has no fast exact solution.
Several simple rules fill core after core; the best result is improved by emptying cores, whose
blocks go, or push smaller ones, to where there is room. Everything is deterministic.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.compile.image.tables import part
from spikeport.compile.image.traffic import BlockTraffic
from spikeport.compile.placing.exchange import Exchanges
from spikeport.compile.placing.load import Capacity, Load, together
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.tally import Tally

Bins = list[list[int]]
"""The blocks of each core."""
EXCHANGES = 300_000
"""The exchanges of blocks that emptying cores tries at most: each takes time in proportion to the
blocks of a core, and their number grows with the square of that of all blocks. A chain of 500 small
ensembles took 170,000 in four packings."""


@dataclass(frozen=True)
class Problem:
    """A packing problem.

    Attributes
    ----------
    loads : sequence of Load
        The load of each block.
    room : Capacity
        The capacity of a core.
    traffic : BlockTraffic
        The spikes between blocks.
    """

    loads: Sequence[Load]
    room: Capacity
    traffic: BlockTraffic

    def load(self, blocks: Iterable[int]) -> Load:
        """Return what blocks take together on one core."""
        return together(self.loads[block] for block in blocks)

    def fits(self, blocks: Iterable[int]) -> bool:
        """Return whether blocks fit on one core."""
        return self.room.holds(self.load(blocks))

    @cached_property
    def fills(self) -> list[float]:
        """The share of the scarcest resource of a core that each block takes."""
        return [self.room.fill(load) for load in self.loads]

    @cached_property
    def partners(self) -> list[dict[int, float]]:
        """The blocks that each block sends spikes to or receives them from, and how many."""
        traffic = self.traffic.direct
        rows = (part(traffic.indptr, block) for block in range(len(self.loads)))
        return [
            dict(zip(traffic.indices[row].tolist(), traffic.data[row].tolist(), strict=True))
            for row in rows
        ]

    @cached_property
    def audiences(self) -> list[dict[int, int]]:
        """The audiences that each block is in, by number, and the sources that each has."""
        found: list[dict[int, int]] = [{} for _ in self.loads]
        for number, (blocks, sources) in enumerate(self.traffic.audiences.items()):
            for block in blocks:
                found[block][number] = sources
        return found

    def exchanged(self, block: int, others: Iterable[int]) -> float:
        """Return the spikes between a block and others."""
        partners, audiences = self.partners[block], self.audiences[block]
        sent = sum(partners.get(other, 0) for other in others)
        shared = (self.audiences[other].keys() & audiences.keys() for other in others if audiences)
        return sent + sum(audiences[number] for numbers in shared for number in numbers)

    @cached_property
    def union(self) -> Load:
        """The load of all blocks together."""
        return together(self.loads)

    def cost(self, bins: Bins) -> tuple[int, float]:
        """Return the number of cores, and the spikes within cores, negated."""
        blocks = np.array([block for mine in bins for block in mine], dtype=int)
        cores = np.repeat(np.arange(len(bins)), [len(mine) for mine in bins])
        shape = (len(bins), len(self.loads))
        on_core = sparse.csr_matrix((np.ones(len(blocks), int), (cores, blocks)), shape)
        # The blocks of each audience on each core: pairs of them would be too many.
        heard = on_core @ self.traffic.members
        pairs = heard.data * (heard.data - 1)
        return len(bins), -float(self.traffic.sources[heard.indices] @ pairs)


def pack(problem: Problem, effort: int) -> Bins:
    """Pack blocks by simple rules and, with any ``effort``, by emptying cores.

    A block that no core holds gets a core of its own.

    Parameters
    ----------
    problem : Problem
        The blocks.
    effort : int
        0 for the simple rules alone.

    Returns
    -------
    bins : Bins
        Every block exactly once.
    """
    # Equal blocks make equal orders.
    distinct = dict.fromkeys(map(tuple, orders(problem)))
    results = (filled(problem, *rule) for rule in product(distinct, CHOICES))
    bins = min(results, key=problem.cost)
    if effort and len(bins) > lower_bound(problem.loads, problem.room)["cores"]:
        bins = emptied(problem, bins)
    return bins


def orders(problem: Problem) -> list[list[int]]:
    """Return orders to place blocks in: as they come, and largest first by several measures."""
    loads, fill = problem.loads, problem.fills
    numbers = range(len(loads))

    def by_amount(kind: int) -> list[int]:
        return sorted(numbers, key=lambda block: -loads[block].amounts[kind])

    by_fill = sorted(numbers, key=lambda block: -fill[block])
    # Blocks with equal profiles follow each other, and open few registers together.
    by_profiles = sorted(numbers, key=lambda block: (loads[block].profiles, -fill[block]))
    kinds = range(len(problem.room.amounts))
    return [list(numbers), by_fill, by_profiles, *map(by_amount, kinds)]


class Candidate(NamedTuple):
    """A core that has room for a block: its blocks so far, and its load without and with it."""

    block: int
    others: Sequence[int]
    before: Load
    after: Load


Rank = tuple[float, ...]
CoreChoice = Callable[[Problem, Candidate], Rank]
"""A rule; of the cores that have room for a block, the first with the smallest rank takes it."""


def first(problem: Problem, core: Candidate) -> Rank:
    """Rank all cores equally."""
    return ()


def fullest(problem: Problem, core: Candidate) -> Rank:
    """Rank cores by how full they are with the block."""
    return (-problem.room.fill(core.after),)


def most_alike(problem: Problem, core: Candidate) -> Rank:
    """Rank cores by the profiles that the block would add."""
    pairs = zip(core.after.profiles, core.before.profiles, strict=True)
    added = sum((after ^ before).bit_count() for after, before in pairs)
    return added, -problem.room.fill(core.after)


def most_traffic(problem: Problem, core: Candidate) -> Rank:
    """Rank cores by the spikes between the block and theirs."""
    return -problem.exchanged(core.block, core.others), -problem.room.fill(core.after)


CHOICES: tuple[CoreChoice, ...] = (first, fullest, most_alike, most_traffic)


class _Cores:
    """Cores that are being filled: the blocks on each, and their load."""

    def __init__(self, problem: Problem, bins: Bins) -> None:
        self._problem = problem
        self.bins = [list(blocks) for blocks in bins]
        self.loads = [problem.load(blocks) for blocks in bins]
        self.tally = Tally(problem.room, problem.union)
        for core, load in enumerate(self.loads):
            self.tally.put(core, load)

    def with_room(self, block: int) -> dict[int, Load]:
        """Return the cores that have room for a block, and their loads with it."""
        load = self._problem.loads[block]
        return {core: self.loads[core].joined(load) for core in self.tally.with_room(load)}

    def put(self, core: int, block: int, load: Load) -> None:
        """Put a block on a core, maybe a new one, which then has the given load."""
        if core == len(self.bins):
            self.bins.append([])
            self.loads.append(load)
        self.set(core, [*self.bins[core], block], load)

    def set(self, core: int, blocks: list[int], load: Load) -> None:
        """Give a core other blocks, which have the given load."""
        self.bins[core], self.loads[core] = blocks, load
        self.tally.put(core, load)


class _Emptying:
    """The attempts to empty cores of a packing, each undone unless it succeeds.

    Attributes
    ----------
    left : int
        The number of exchanges that may still be tried.
    """

    def __init__(self, problem: Problem, bins: Bins, left: int) -> None:
        self._problem = problem
        self._cores = _Cores(problem, bins)
        self._exchanges = Exchanges(problem.loads, problem.room, self._cores.tally)
        for core, blocks in enumerate(bins):
            self._exchanges.put(core, blocks)
        self._fills = np.array(problem.fills)
        self._before: dict[int, tuple[list[int], Load]] = {}
        self._victim = -1
        self.left = left

    def without(self, victim: int) -> Bins | None:
        """Return the packing with the blocks of one core on others; None if they find no room."""
        self._victim, self._before = victim, {}
        # The largest first, while there is most room.
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
        """Place a block, if need be where a smaller one makes room; return whether it can."""
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
        at.pop(self._victim, None)
        for core in sorted(at):
            kinds = set()
            for other in self._cores.bins[core]:
                # Images have many equal blocks: where one makes no room, equal ones make none.
                if other in at[core] and (kind := self._problem.loads[other]) not in kinds:
                    kinds.add(kind)
                    yield core, other

    def _place(self, block: int, but: int = -1) -> bool:
        """Put a block on the core that is fullest with it; return whether one has room."""
        after = self._cores.with_room(block)
        after.pop(but, None)
        after.pop(self._victim, None)
        if after:
            best = max(after, key=lambda core: self._problem.room.fill(after[core]))
            self._set(best, [*self._cores.bins[best], block], after[best])
        return bool(after)

    def _push(self, core: int, other: int, block: int) -> bool:
        """Put a block in the place of another, which goes to a third core; return whether it can.

        If it cannot, nothing changes.
        """
        if not self.left:
            return False
        self.left -= 1
        blocks = [*(b for b in self._cores.bins[core] if b != other), block]
        load = self._problem.load(blocks)
        if not self._problem.room.holds(load) or not self._place(other, but=core):
            return False
        self._set(core, blocks, load)
        return True

    def _set(self, core: int, blocks: list[int], load: Load) -> None:
        self._before.setdefault(core, (self._cores.bins[core], self._cores.loads[core]))
        self._put(core, blocks, load)

    def _put(self, core: int, blocks: list[int], load: Load) -> None:
        self._cores.set(core, blocks, load)
        self._exchanges.put(core, blocks)


def filled(problem: Problem, order: Sequence[int], choice: CoreChoice) -> Bins:
    """Place blocks in an order, each on a core that has room, or else on a new one."""
    cores = _Cores(problem, [])
    for block in order:
        after = cores.with_room(block)
        ranks = {
            core: choice(problem, Candidate(block, cores.bins[core], cores.loads[core], load))
            for core, load in after.items()
        }
        best = min(ranks, key=ranks.__getitem__, default=len(cores.bins))
        cores.put(best, block, after.get(best, problem.loads[block]))
    return cores.bins


def emptied(problem: Problem, bins: Bins, exchanges: int = EXCHANGES) -> Bins:
    """Empty one core after another while their blocks find room elsewhere.

    Parameters
    ----------
    problem : Problem
        The blocks.
    bins : Bins
        A packing of them; stays as it is.
    exchanges : int
        How often it is tried, in all, to put a block in the place of another.
    """
    while True:
        emptying = _Emptying(problem, bins, exchanges)
        fewer = _with_one_emptied(problem, bins, emptying)
        exchanges = emptying.left
        if fewer is None:
            return bins
        bins = fewer


def _with_one_emptied(problem: Problem, bins: Bins, emptying: _Emptying) -> Bins | None:
    """Empty one core, the emptiest that can be; None if none can."""
    tried = set()
    for victim in emptying.by_fill():
        # Images have many equal blocks: where some found no room, equal ones find none.
        loads = tuple(sorted(problem.loads[block] for block in bins[victim]))
        if loads in tried:
            continue
        tried.add(loads)
        if (fewer := emptying.without(victim)) is not None:
            return fewer
    return None
