"""Spikes between a block and cores, while blocks move from core to core."""

from collections import Counter
from collections.abc import Sequence

from spikeport.compile.placing.problem import Problem


class CoreTraffic:
    """Blocks on cores, and the number of blocks of each audience on each core.

    It does not list pairs of blocks of an audience, since they would be too many.

    Attributes
    ----------
    core : dict of int to int
        The core of each block that is on one.

    Parameters
    ----------
    problem : Problem
        The blocks.
    bins : sequence of sequence of int
        The blocks of each core; some blocks may be on no core.
    """

    def __init__(self, problem: Problem, bins: Sequence[Sequence[int]]) -> None:
        self._partners, self._audiences = problem.partners, problem.audiences
        self.core = {block: core for core, blocks in enumerate(bins) for block in blocks}
        self._counts = [
            Counter(self.core[block] for block in blocks if block in self.core)
            for blocks in problem.traffic.audiences
        ]

    def move(self, block: int, core: int) -> None:
        """Put a block on a core, maybe from another."""
        home = self.core.get(block)
        if home == core:
            return
        self.core[block] = core
        for number in self._audiences[block]:
            on_cores = self._counts[number]
            on_cores[core] += 1
            if home is not None:
                on_cores[home] -= 1
                if not on_cores[home]:
                    del on_cores[home]

    def spikes(self, block: int) -> dict[int, float]:
        """Return the spikes between a block and each core that it exchanges any with."""
        spikes: dict[int, float] = {}
        home = self.core.get(block)
        for partner, n in self._partners[block].items():
            if (core := self.core.get(partner)) is not None:
                spikes[core] = spikes.get(core, 0) + n
        for number, sources in self._audiences[block].items():
            for core, n in self._counts[number].items():
                # A block is no partner of itself.
                if others := n - (core == home):
                    spikes[core] = spikes.get(core, 0) + sources * others
        return spikes
