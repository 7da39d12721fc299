"""Packing of blocks onto as few cores as possible, with blocks that exchange spikes on one core.

This is bin packing with several amounts and with shared profiles, which has no fast exact solution.
Several simple rules fill core after core; the best result is improved by emptying cores.
Everything is deterministic.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from spikeport.compile.placing.cores import Cores
from spikeport.compile.placing.emptying import emptied
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.problem import Bins, Problem


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


Ranks = tuple[np.ndarray, ...]
CoreChoice = Callable[[Cores, int, np.ndarray], Ranks]
"""A rule that ranks the cores with room for a block: the first core of the smallest rank takes it.

Where ranks of the first kind are equal, ranks of the second kind decide.
"""


def first(cores: Cores, block: int, candidates: np.ndarray) -> Ranks:
    """Rank all cores equally."""
    return ()


def fullest(cores: Cores, block: int, candidates: np.ndarray) -> Ranks:
    """Rank cores by how full they are with the block."""
    return (-cores.fills(block, candidates),)


def most_alike(cores: Cores, block: int, candidates: np.ndarray) -> Ranks:
    """Rank cores by the profiles that the block would add."""
    return cores.added(block, candidates), -cores.fills(block, candidates)


def most_traffic(cores: Cores, block: int, candidates: np.ndarray) -> Ranks:
    """Rank cores by the spikes between the block and the cores' blocks."""
    return -cores.spikes(block, candidates), -cores.fills(block, candidates)


CHOICES: tuple[CoreChoice, ...] = (first, fullest, most_alike, most_traffic)


def filled(problem: Problem, order: Sequence[int], choice: CoreChoice) -> Bins:
    """Place blocks in an order, each on a core that has room, or else on a new one."""
    cores = Cores(problem, [])
    for block in order:
        best = cores.with_room(block)
        if len(best) > 1:
            # `lexsort` takes the last key first; the number of the core decides between equals.
            best = best[np.lexsort((best, *reversed(choice(cores, block, best))))]
        cores.put(int(best[0]) if len(best) else len(cores.bins), block)
    return cores.bins
