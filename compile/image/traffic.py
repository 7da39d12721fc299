"""Spikes from block to block, and from core to core, where all neurons spike alike."""

import numpy as np
from scipy import sparse

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries


def reached_blocks(image: ChipImage) -> sparse.csr_matrix:
    """Return a matrix with 1 where a source's spikes reach a block, (n_sources, n_blocks)."""
    ways = deliveries(image)
    at = (ways.source, image.groups.block[ways.group])
    shape = (image.n_sources, image.n_blocks)
    reached = sparse.csr_matrix((np.ones(len(ways.source), int), at), shape)
    reached.data[:] = 1  # a source may reach a block by several routes
    return reached


def block_traffic(image: ChipImage) -> sparse.csr_matrix:
    """Return the spikes that stay on a core, or are sent once, if two blocks share it.

    For each pair of blocks the compartments of each that reach the other, and the sources that
    reach both: (n_blocks, n_blocks), symmetric, 0 on the diagonal.
    """
    reached = reached_blocks(image)
    shape = (image.n_blocks, image.n_blocks)
    on_chip = reached[: image.n_compartments].tocoo()
    at = (image.compartment_block[on_chip.row], on_chip.col)
    direct = sparse.csr_matrix((np.ones(on_chip.nnz, int), at), shape)
    traffic = (direct + direct.T + reached.T @ reached).tocoo()
    between = traffic.row != traffic.col
    at = (traffic.row[between], traffic.col[between])
    return sparse.csr_matrix((traffic.data[between], at), shape)


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
