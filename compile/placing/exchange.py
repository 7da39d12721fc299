"""The blocks of cores as arrays, which show at once which blocks could make room for another."""

from collections.abc import Sequence

import numpy as np

from spikeport.compile.placing.load import Capacity, Load
from spikeport.compile.placing.tally import Tally


class Exchanges:
    """The blocks of cores, to find the blocks that could give their place to a load.

    Few blocks can, and joining loads is slow: this rules out most of the others by a few operations
    on arrays, whatever their number.

    Parameters
    ----------
    loads : sequence of Load
        The load of each block.
    room : Capacity
        The capacity of a core.
    tally : Tally
        The loads of the cores, which the caller keeps up to date.
    """

    def __init__(self, loads: Sequence[Load], room: Capacity, tally: Tally) -> None:
        self._loads, self._tally = loads, tally
        self._room = np.array(room.amounts)
        self._amounts = np.array([load.amounts for load in loads])
        self._core = np.zeros(len(loads), dtype=int)
        self._alone = {number: np.zeros(len(loads), dtype=int) for number in tally.limited}

    def put(self, core: int, blocks: Sequence[int]) -> None:
        """Set the blocks of a core."""
        self._core[blocks] = core
        for number, alone in self._alone.items():
            masks = [self._loads[block].profiles[number] for block in blocks]
            one = several = 0
            for mask in masks:
                several |= one & mask
                one |= mask
            # A block that leaves takes away the profiles that no other block of the core has.
            alone[blocks] = [(mask & ~several).bit_count() for mask in masks]

    def possible(self, load: Load, blocks: np.ndarray) -> np.ndarray:
        """Return the blocks, out of some, that may make room for a load; the others cannot."""
        core = self._core[blocks]
        amounts = self._tally.amounts[core] - self._amounts[blocks] + load.amounts
        possible: np.ndarray = (amounts <= self._room).all(axis=1)
        for number, alone in self._alone.items():
            # A lower bound: profiles that block and load share would stay.
            joined = self._tally.joined_on_all(number, load.profiles[number])[core] - alone[blocks]
            possible &= joined <= self._tally.limited[number]
        found: np.ndarray = blocks[possible]
        return found

    def core_of(self, blocks: np.ndarray) -> np.ndarray:
        """Return the cores of some blocks."""
        cores: np.ndarray = self._core[blocks]
        return cores
