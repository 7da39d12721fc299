"""Spikes from block to block, and from core to core, if all neurons spike equally often."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries
from spikeport.compile.image.tables import flat, parts


@dataclass(frozen=True)
class BlockTraffic:
    """Spikes that stay on a core, or are sent once, if two blocks share it.

    These are, for each pair of blocks, the compartments of each block that reach the other, and the
    sources that reach both. Sources are counted by audience, which is the set of blocks that they
    reach, as a source that reaches n blocks makes n^2 pairs.

    Attributes
    ----------
    direct : (n_blocks, n_blocks) sparse matrix
        The number of compartments of either block that reach the other; symmetric, 0 on the
        diagonal.
    audiences : mapping of tuple of int to int
        The number of sources that reach exactly these blocks, two or more.
    """

    direct: sparse.csr_matrix
    audiences: Mapping[tuple[int, ...], int]

    @cached_property
    def members(self) -> sparse.csr_matrix:
        """A matrix with 1 where a block is in an audience, (n_blocks, n_audiences).

        Each pair of blocks of `direct` is an audience of two; these pairs follow `audiences`.
        """
        pairs = sparse.triu(self.direct, format="coo")
        sizes = [len(blocks) for blocks in self.audiences]
        heard, sent = np.arange(len(sizes)), len(sizes) + np.arange(pairs.nnz)
        block = flat([*map(np.array, self.audiences), pairs.row, pairs.col])
        number = flat([np.repeat(heard, sizes), sent, sent])
        shape = (self.direct.shape[0], len(heard) + len(sent))
        return sparse.csr_matrix((np.ones(len(block), int), (block, number)), shape)

    @cached_property
    def sources(self) -> np.ndarray:
        """The number of sources of each audience of `members`, (n_audiences,)."""
        pairs = sparse.triu(self.direct, format="coo")
        return flat([np.array(list(self.audiences.values()), int), pairs.data])


def reached_blocks(image: ChipImage) -> sparse.csr_matrix:
    """Return a matrix with 1 where a source's spikes reach a block, (n_sources, n_blocks)."""
    paths = deliveries(image)
    at = (paths.source, image.groups.block[paths.group])
    shape = (image.n_sources, image.n_blocks)
    reached = sparse.csr_matrix((np.ones(len(paths.source), int), at), shape)
    reached.sum_duplicates()
    reached.data[:] = 1  # a source may reach a block by several routes
    return reached


def block_traffic(image: ChipImage) -> BlockTraffic:
    """Return the spikes between blocks of an image."""
    reached = reached_blocks(image)
    on_chip = reached[: image.n_compartments].tocoo()
    sender = image.compartment_block[on_chip.row]
    between = sender != on_chip.col
    shape = (image.n_blocks, image.n_blocks)
    ends = sender[between], on_chip.col[between]
    direct = sparse.csr_matrix((on_chip.data[between], ends), shape)
    rows = parts(reached.indptr, reached.indices)
    sources = Counter(tuple(row.tolist()) for row in rows if len(row) > 1)
    return BlockTraffic(sparse.csr_matrix(direct + direct.T), sources)


def core_messages(image: ChipImage) -> np.ndarray:
    """Return the messages between cores if every compartment spikes once, (n_cores, n_cores)."""
    reached = reached_blocks(image)[: image.n_compartments]
    on_core = sparse.csr_matrix(
        (np.ones(image.n_blocks, int), (np.arange(image.n_blocks), image.blocks.core)),
        (image.n_blocks, image.n_cores),
    )
    cores = (reached @ on_core).tocoo()
    messages = np.zeros((image.n_cores, image.n_cores), dtype=int)
    np.add.at(messages, (image.compartment_core[cores.row], cores.col), 1)
    return messages
