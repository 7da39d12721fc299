"""Spikes that come to be within cores if two blocks are swapped, for many blocks at once."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.tables import flat, parts
from spikeport.compile.image.traffic import BlockTraffic


class _CoreAudiences(NamedTuple):
    """The audiences of the blocks of a core: their numbers, and the position of the block of each.

    ``n`` is the number of blocks.
    """

    audience: np.ndarray
    position: np.ndarray
    n: int


class Gains:
    """The spikes that swaps bring within cores, less the spikes that they take out.

    Two blocks of which one sends to the other are an audience of two. Let i_a be 1 if block i is in
    audience a, else 0; n_ca the number of blocks of audience a on core c; s_a its number of
    sources. The swap of block i of core h with block j of core c brings

        sum_a s_a (i_a - j_a) (n_ca - n_ha + i_a - j_a)

    Parameters
    ----------
    traffic : BlockTraffic
        The spikes between blocks.
    bins : sequence of sequence of int
        The blocks of each core.
    """

    def __init__(self, traffic: BlockTraffic, bins: Sequence[Sequence[int]]) -> None:
        members = traffic.members
        self._audiences = parts(members.indptr, members.indices)
        self._sources = traffic.sources
        # Zeros, except while `of` counts: it clears only its own entries, as most audiences are on
        # few cores.
        self._count = np.zeros(len(self._sources), dtype=int)
        self._cores = [self._audiences_of(blocks) for blocks in bins]

    def put(self, core: int, blocks: Sequence[int]) -> None:
        """Set the blocks of a core."""
        self._cores[core] = self._audiences_of(blocks)

    def of(self, block: int, home: int, core: int) -> np.ndarray:
        """Return the gains of swapping a block of one core with each block of another, in order."""
        mine, sources, count = self._audiences[block], self._sources, self._count
        ours, theirs = self._cores[home], self._cores[core]
        np.add.at(count, theirs.audience, 1)
        np.subtract.at(count, ours.audience, 1)
        gain = (sources[mine] * (count[mine] + 1)).sum()
        # The products of i_a and j_a in the formula, which are 0 for all other audiences.
        count[mine] += 2
        each = sources[theirs.audience] * (1 - count[theirs.audience])
        count[theirs.audience] = count[ours.audience] = 0
        gains: np.ndarray = gain + np.bincount(theirs.position, each, theirs.n)
        return gains

    def _audiences_of(self, blocks: Sequence[int]) -> _CoreAudiences:
        audiences = [self._audiences[block] for block in blocks]
        sizes = [len(mine) for mine in audiences]
        return _CoreAudiences(
            flat(audiences), np.repeat(np.arange(len(blocks)), sizes), len(blocks)
        )
