"""Cores while blocks are put on them."""

import numpy as np

from spikeport.compile.placing.core_traffic import CoreTraffic
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
        self._traffic: CoreTraffic | None = None  # built on first use: most rules need none

    def with_room(self, block: int) -> np.ndarray:
        """Return the cores that have room for a block, ascending."""
        return self.tally.with_room(self._problem.loads[block])

    def fills(self, block: int, cores: np.ndarray) -> np.ndarray:
        """Return how full some cores would be with a block, (n,)."""
        return self.tally.fills(self._problem.loads[block], cores)

    def added(self, block: int, cores: np.ndarray) -> np.ndarray:
        """Return how many profiles a block would add to some cores, (n,)."""
        return self.tally.added(self._problem.loads[block], cores)

    def spikes(self, block: int, cores: np.ndarray) -> np.ndarray:
        """Return the spikes between a block and some cores, (n,)."""
        if self._traffic is None:
            self._traffic = CoreTraffic(self._problem, self.bins)
        spikes = self._traffic.spikes(block)
        return np.array([spikes.get(core, 0) for core in cores.tolist()])

    def put(self, core: int, block: int) -> None:
        """Put a block on a core, maybe a new one."""
        load = self._problem.loads[block]
        if core == len(self.bins):
            self.bins.append([])
            self.loads.append(load)
        else:
            load = self.loads[core].joined(load)
        self.set(core, [*self.bins[core], block], load)

    def set(self, core: int, blocks: list[int], load: Load) -> None:
        """Put other blocks on a core, with their load."""
        self.bins[core], self.loads[core] = blocks, load
        self.tally.put(core, load)
        if self._traffic is not None:
            for block in blocks:
                self._traffic.move(block, core)
