"""Cores while blocks are put on them."""

from spikeport.compile.placing.load import Load
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.compile.placing.tally import Tally


class Cores:
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
