"""Packing problems: blocks, their loads, and the spikes that packings keep within cores."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from spikeport.compile.image.tables import part
from spikeport.compile.image.traffic import BlockTraffic
from spikeport.compile.placing.load import Capacity, Load, together

Bins = list[list[int]]
"""The blocks of each core."""


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
        """Return the load of blocks together on one core."""
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
        """The audiences that each block is in, by number, and the number of sources of each."""
        found: list[dict[int, int]] = [{} for _ in self.loads]
        for number, (blocks, sources) in enumerate(self.traffic.audiences.items()):
            for block in blocks:
                found[block][number] = sources
        return found

    @cached_property
    def union(self) -> Load:
        """The load of all blocks together."""
        return together(self.loads)

    def cost(self, bins: Bins) -> tuple[int, float]:
        """Return the number of cores, and the spikes within cores, negated."""
        blocks = np.array([block for mine in bins for block in mine], dtype=int)
        ends = np.cumsum([0, *map(len, bins)])
        shape = (len(bins), len(self.loads))
        on_core = sparse.csr_matrix((np.ones(len(blocks), int), blocks, ends), shape)
        # The number of blocks of each audience on each core: pairs of blocks would be too many.
        heard = on_core @ self.traffic.members
        pairs = heard.data * (heard.data - 1)
        return len(bins), -float(self.traffic.sources[heard.indices] @ pairs)
