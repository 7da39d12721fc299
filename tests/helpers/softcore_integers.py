"""The integers of a memory image and of a chip image, in one form that can be compared.

A memory image does not separate blocks, groups, axons and atoms. Both have the constants of each
compartment, the bounds of its voltage, and the sum that a spike of each source adds to each
compartment, modulo 2^22. A step computes with nothing else.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.backends.native.contacts import contacts_of, pairs_of
from spikeport.backends.native.rows import rows_of
from spikeport.backends.softcore.memory import CoreMemory, MemoryImage, wrapped
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import STATE_BITS, SUM_BITS
from spikeport.compile.image.soft_rows import WEIGHT_BITS
from spikeport.compile.image.tables import ranges


class Integers(NamedTuple):
    """The integers that a step computes with, compartments in the image's order."""

    constants: np.ndarray
    """bias, decay_u, decay_v, vth, refract_delay, vmin and vmax, (7, n_compartments)."""
    weights: sparse.csr_array
    """Sums that a spike of a source adds, wrapped to 22 bits, (n_sources, n_compartments)."""


def of_image(image: ChipImage) -> Integers:
    """Return the integers of an image."""
    block, c = image.compartment_block, image.compartments
    constants = [c.bias, c.decay_u, c.decay_v, c.vth, c.refract_delay]
    constants += [image.blocks.vmin[block], image.blocks.vmax[block]]
    rows, contacts, pairs = rows_of(image), contacts_of(image), pairs_of(image)
    used = contacts.used[pairs.contact]
    source, contact = pairs.source[used], pairs.contact[used]
    row = contacts.row[contact]
    sizes = np.diff(rows.start)[row]
    places = ranges(rows.start[row], sizes)
    targets = rows.indices[places] + np.repeat(contacts.first[contact], sizes)
    weights = rows.weights[places]
    shape = image.n_sources, image.n_compartments
    return Integers(np.stack(constants), _summed(np.repeat(source, sizes), targets, weights, shape))


def of_memory(memory: MemoryImage) -> Integers:
    """Return the integers of a memory image."""
    n = len(memory.order)
    sources, targets, weights = [], [], []
    for source, (core, row) in (
        (source, one) for source, some in enumerate(memory.messages_by_source()) for one in some
    ):
        local, added = decoded(memory.cores[core].rows, row, memory.unit)
        targets.append(memory.order[memory.first[core] + local])
        weights.append(added)
        sources.append(np.full(len(local), source))
    nothing = [np.zeros(0, dtype=np.int64)]
    of, to, sizes = (np.concatenate(nothing + one) for one in (sources, targets, weights))
    shape = n + len(memory.host_start) - 1, n
    constants = np.empty((7, n), dtype=np.int64)
    constants[:, memory.order] = np.concatenate([_constants(c) for c in memory.cores], axis=1)
    return Integers(constants, _summed(of, to, sizes, shape))


def decoded(words: np.ndarray, at: int, unit: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the compartments of a core and the weights that the row at an address adds."""
    header, first, *_ = words[at : at + 2].astype(np.int64)
    shift, is_dense, entries = header >> 11, header >> 10 & 1, (header & 0x3FF) + 1
    begin = at + 2
    if is_dense:
        pairs = words[begin : begin + -(-entries // 2)].astype(np.int64)
        octets = np.column_stack([pairs & 0xFF, pairs >> 8]).ravel()[:entries]
        targets = first + np.arange(entries)
    else:
        content = words[begin : begin + entries].astype(np.int64)
        octets, targets = content & 0xFF, first + np.cumsum(content >> 8)
    return targets, wrapped(octets, WEIGHT_BITS) << (shift + unit)


def _constants(core: CoreMemory) -> np.ndarray:
    words = core.constants.astype(np.int64)
    profile = core.profiles.astype(np.int64)[words >> 24 & 31]
    voltages = np.full(len(words), core.voltages, dtype=np.int64)
    return np.stack(
        [
            wrapped(words, STATE_BITS),
            # A core stores the share that is kept, nengo-loihi the decay.
            4095 - (profile & 0xFFF),
            4096 - (profile >> 12 & 0x1FFF),
            wrapped(core.thresholds[words >> 29 & 31], STATE_BITS),
            profile >> 25,
            wrapped(voltages >> STATE_BITS, STATE_BITS),
            wrapped(voltages, STATE_BITS),
        ]
    )


def _summed(
    sources: np.ndarray, targets: np.ndarray, weights: np.ndarray, shape: tuple[int, int]
) -> sparse.csr_array:
    """Return the sums of weights from source to target, wrapped, without zeros."""
    sums = sparse.coo_array((weights.astype(np.int64), (sources, targets)), shape=shape).tocsr()
    sums.data = wrapped(sums.data, SUM_BITS)
    sums.eliminate_zeros()
    return sums
