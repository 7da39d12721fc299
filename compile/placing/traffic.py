"""How many spikes go from block to block, and from core to core, where all neurons spike alike."""

import numpy as np
from scipy import sparse

from spikeport.compile.fanout import first_sources
from spikeport.compile.image import ChipImage


def reached_blocks(image: ChipImage) -> sparse.csr_matrix:
    """(n_sources, n_blocks) 1 where a source's spikes reach a block, inputs after compartments."""
    targets = image["synapse_block"][image["route_synapse"]]
    parts = [image.part("route_start", route) for route in range(len(targets))]
    used = [np.flatnonzero(image["route_axon"][part] >= 0) for part in parts]
    firsts = first_sources(image)
    source = [first + mine for first, mine in zip(firsts, used, strict=True)]
    target = np.repeat(targets, [len(mine) for mine in used])
    n_sources = image.n_compartments + int(image["input_size"].sum())
    at = (np.concatenate([np.zeros(0, dtype=int), *source]), target)
    reached = sparse.csr_matrix((np.ones(len(target), int), at), (n_sources, image.n_blocks))
    reached.data[:] = 1
    return reached


def block_traffic(image: ChipImage) -> np.ndarray:
    """(n_blocks, n_blocks) spikes that stay on a core, or are sent once, if two blocks share it.

    For each pair of blocks the compartments of each that reach the other, and the sources that
    reach both; symmetric, 0 on the diagonal.
    """
    reached = reached_blocks(image)
    owner = np.repeat(np.arange(image.n_blocks), np.diff(image["block_start"]))
    direct = np.zeros((image.n_blocks, image.n_blocks), dtype=int)
    on_chip = reached[: image.n_compartments].tocoo()
    np.add.at(direct, (owner[on_chip.row], on_chip.col), 1)
    traffic = direct + direct.T + (reached.T @ reached).toarray()
    np.fill_diagonal(traffic, 0)
    return traffic


def core_messages(image: ChipImage) -> np.ndarray:
    """(n_cores, n_cores) messages from core (row) to core if every compartment spikes once."""
    reached = reached_blocks(image)[: image.n_compartments]
    on_core = sparse.csr_matrix(
        (np.ones(image.n_blocks, int), (np.arange(image.n_blocks), image["block_core"])),
        (image.n_blocks, image.n_cores),
    )
    cores = (reached @ on_core).tocoo()
    messages = np.zeros((image.n_cores, image.n_cores), dtype=int)
    np.add.at(messages, (image.compartment_core[cores.row], cores.col), 1)
    return messages
