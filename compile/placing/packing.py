"""Blocks onto as few cores as can be found, and those that send to each other onto the same one.

Several simple rules fill core after core; the best result is improved by emptying cores, whose
blocks go, or push smaller ones, to where there is room. Everything is deterministic.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from spikeport.compile.placing.load import Capacity, Load, together
from spikeport.compile.placing.lower_bound import lower_bound

Bins = list[list[int]]
"""The blocks of each core."""


@dataclass(frozen=True)
class Problem:
    """What to pack: the load of each block, a core's room, and the spikes between blocks.

    ``traffic`` is (n_blocks, n_blocks), symmetric.
    """

    loads: Sequence[Load]
    room: Capacity
    traffic: np.ndarray

    def load(self, blocks: Iterable[int]) -> Load:
        """What blocks take on one core."""
        return together(self.loads[block] for block in blocks)

    def fits(self, blocks: Iterable[int]) -> bool:
        """Whether blocks fit on one core."""
        return self.room.holds(self.load(blocks))

    @cached_property
    def fills(self) -> list[float]:
        """Share of the scarcest resource of a core that each block takes."""
        return [self.room.fill(load) for load in self.loads]

    def cost(self, bins: Bins) -> tuple[int, float]:
        """Number of cores, and spikes between them, negated if within."""
        within = sum(self.traffic[np.ix_(blocks, blocks)].sum() for blocks in bins)
        return len(bins), -float(within)


def pack(problem: Problem, effort: int) -> Bins:
    """Pack blocks; without ``effort`` by the simple rules alone."""
    results = (_filled(problem, *rule) for rule in product(_orders(problem), CHOICES))
    bins = min(results, key=problem.cost)
    if effort and len(bins) > lower_bound(problem.loads, problem.room)["cores"]:
        bins = _emptied(problem, bins)
    return bins


def _orders(problem: Problem) -> list[list[int]]:
    """Orders to place blocks in: as they come, and largest first by several measures."""
    loads, fill = problem.loads, problem.fills
    numbers = range(len(loads))
    by_amount = [
        sorted(numbers, key=lambda b, k=k: -loads[b].amounts[k])  # type: ignore[misc]
        for k in range(len(problem.room.amounts))
    ]
    by_fill = sorted(numbers, key=lambda b: -fill[b])
    alike = sorted(numbers, key=lambda b: (loads[b].profiles, -fill[b]))
    return [list(numbers), by_fill, alike, *by_amount]


def _first(problem: Problem, blocks: list[int], before: Load, after: Load) -> Any:
    return 0


def _fullest(problem: Problem, blocks: list[int], before: Load, after: Load) -> Any:
    return -problem.room.fill(after)


def _most_alike(problem: Problem, blocks: list[int], before: Load, after: Load) -> Any:
    new = sum((a ^ b).bit_count() for a, b in zip(after.profiles, before.profiles, strict=True))
    return new, -problem.room.fill(after)


def _most_talkative(problem: Problem, blocks: list[int], before: Load, after: Load) -> Any:
    *others, block = blocks
    return -problem.traffic[block, others].sum(), -problem.room.fill(after)


CHOICES = (_first, _fullest, _most_alike, _most_talkative)
"""Which of the cores that have room takes a block: the one with the smallest of these."""


class _Cores:
    """Cores that are being filled: the blocks on each, and what they take."""

    def __init__(self, problem: Problem, bins: Bins) -> None:
        self._problem = problem
        self.bins = [list(blocks) for blocks in bins]
        self.loads = [problem.load(blocks) for blocks in bins]

    def after(self, block: int) -> dict[int, Load]:
        """The cores that have room for a block, and what they hold with it."""
        room, load = self._problem.room, self._problem.loads[block]
        free = np.array([held.amounts for held in self.loads]).reshape(-1, len(load.amounts))
        enough = np.flatnonzero((free + load.amounts <= room.amounts).all(axis=1))
        after = {core: self.loads[core].joined(load) for core in enough.tolist()}
        return {core: held for core, held in after.items() if room.holds(held)}

    def put(self, core: int, block: int, load: Load) -> None:
        """Put a block on a core, which then holds a load."""
        if core == len(self.bins):
            self.bins.append([])
            self.loads.append(load)
        self.bins[core].append(block)
        self.loads[core] = load

    def place(self, block: int, but: int = -1) -> bool:
        """Put a block on the core that is fullest with it, where there is one with room."""
        after = self.after(block)
        after.pop(but, None)
        if after:
            best = max(after, key=lambda core: self._problem.room.fill(after[core]))
            self.put(best, block, after[best])
        return bool(after)

    def push(self, core: int, other: int, block: int) -> bool:
        """Put a block in the place of a smaller one, which fits on a third core."""
        rest = [b for b in self.bins[core] if b != other]
        if not self._problem.fits([*rest, block]) or not self.place(other, but=core):
            return False
        self.bins[core], self.loads[core] = [*rest, block], self._problem.load([*rest, block])
        return True

    def take(self, block: int) -> bool:
        """Place a block, if need be where another one makes room."""
        fills = self._problem.fills
        return self.place(block) or any(
            self.push(core, other, block)
            for core, blocks in enumerate(self.bins)
            for other in list(blocks)
            if fills[other] < fills[block]
        )


def _filled(problem: Problem, order: list[int], choice: Callable[..., Any]) -> Bins:
    """Place blocks in an order, each on a core that has room, or else on a new one."""
    cores = _Cores(problem, [])
    for block in order:
        after = cores.after(block) or {len(cores.bins): problem.loads[block]}
        keys = {
            core: choice(problem, [*cores.bins[core], block], cores.loads[core], load)
            for core, load in after.items()
            if core < len(cores.bins)
        }
        best = min(keys, key=keys.__getitem__, default=len(cores.bins))
        cores.put(best, block, after[best])
    return cores.bins


def _emptied(problem: Problem, bins: Bins) -> Bins:
    """Empty one core after another, emptiest first, while their blocks find room elsewhere."""
    tried = set()
    for victim in sorted(bins, key=lambda blocks: problem.room.fill(problem.load(blocks))):
        alike = tuple(sorted(problem.loads[block] for block in victim))
        if alike in tried:
            continue
        tried.add(alike)
        rest = _Cores(problem, [blocks for blocks in bins if blocks is not victim])
        if all(rest.take(block) for block in sorted(victim, key=lambda b: -problem.fills[b])):
            return _emptied(problem, rest.bins)
    return bins


def settled(problem: Problem, bins: Bins) -> Bins:
    """Move or swap blocks onto the core they share most spikes with, until none can be."""
    bins = [list(blocks) for blocks in bins]
    while sum(_settle(problem, bins, block) for block in range(len(problem.loads))):
        pass
    return [blocks for blocks in bins if blocks]


def _settle(problem: Problem, bins: Bins, block: int) -> bool:
    """Move one block, or swap it with another, if more spikes are shared on cores then."""
    traffic = problem.traffic
    home = next(blocks for blocks in bins if block in blocks)
    now = traffic[block, home].sum()
    better = [blocks for blocks in bins if traffic[block, blocks].sum() > now]
    for there in sorted(better, key=lambda blocks: -traffic[block, blocks].sum()):
        if problem.fits([*there, block]):
            home.remove(block)
            there.append(block)
            return True
        if any(_swap(problem, home, there, block, other) for other in list(there)):
            return True
    return False


def _swap(problem: Problem, home: list[int], there: list[int], block: int, other: int) -> bool:
    """Swap two blocks if both fit and more spikes are shared on the two cores then."""
    traffic = problem.traffic
    left, rest = ([b for b in blocks if b not in (block, other)] for blocks in (home, there))
    gain = traffic[block, rest].sum() + traffic[other, left].sum()
    loss = traffic[block, left].sum() + traffic[other, rest].sum()
    if gain <= loss or not (problem.fits([*rest, block]) and problem.fits([*left, other])):
        return False
    home[:], there[:] = [*left, other], [*rest, block]
    return True
