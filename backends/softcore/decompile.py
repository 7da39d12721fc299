"""The integers of a memory image, and those of an image, in one form that can be compared.

A memory image does not separate blocks, groups, axons and atoms. The same in both, and all that a
step computes with, are the constants of each compartment, the bounds of its voltage, and what a
spike of each source adds to each compartment, modulo 2^22.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.backends.native.contacts import contacts_of, pairs_of
from spikeport.backends.native.rows import rows_of
from spikeport.backends.softcore.memory import (
    ROW_BITS,
    SUM_BITS,
    VALUE_BITS,
    CoreMemory,
    MemoryImage,
    wrapped,
)
from spikeport.backends.softcore.rows import decoded
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import ranges


class Integers(NamedTuple):
    """The integers that a step computes with, compartments in the image's order."""

    constants: np.ndarray
    """bias, decay_u, decay_v, vth, refract_delay, vmin and vmax, (7, n_compartments)."""
    weights: sparse.csr_array
    """Sums of what a spike of a source adds, wrapped to 22 bits, (n_sources, n_compartments)."""


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
        (source, one) for source, some in enumerate(messages_of(memory)) for one in some
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


def messages_of(memory: MemoryImage) -> list[list[tuple[int, int]]]:
    """Return core and row of each message that a spike of a source sends, by source.

    Sources are the image's compartments, in its order, then those on the host.
    """
    n = len(memory.order)
    lists: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    mask = (1 << memory.core_bits) - 1
    for first, core in zip(memory.first, memory.cores, strict=True):
        for local, word in enumerate(core.constants.tolist()):
            # The layout is that of `CoreMemory.constants`: axon from bit 34 on, sends at bit 46.
            at, more = word >> 34 & 0xFFF, bool(word >> 46)
            while more:
                axon = int(core.axons[at])
                found = axon >> ROW_BITS & mask, axon & ((1 << ROW_BITS) - 1)
                lists[memory.order[first + local]].append(found)
                # Axons of a compartment follow each other; the last one's top bit is set.
                at, more = at + 1, not axon >> (ROW_BITS + memory.core_bits)
    host = [(core, row) for core, row in memory.host_messages.tolist()]
    ends = memory.host_start.tolist()
    return lists + [host[begin:end] for begin, end in itertools.pairwise(ends)]


def _constants(core: CoreMemory) -> np.ndarray:
    words = core.constants.astype(np.int64)
    profile = core.profiles.astype(np.int64)[words >> 24 & 31]
    voltages = np.full(len(words), core.voltages, dtype=np.int64)
    return np.stack(
        [
            wrapped(words, VALUE_BITS),
            # A core stores the share that is kept, nengo-loihi the decay.
            4095 - (profile & 0xFFF),
            4096 - (profile >> 12 & 0x1FFF),
            wrapped(core.thresholds[words >> 29 & 31], VALUE_BITS),
            profile >> 25,
            wrapped(voltages >> VALUE_BITS, VALUE_BITS),
            wrapped(voltages, VALUE_BITS),
        ]
    )


def _summed(
    sources: np.ndarray, targets: np.ndarray, weights: np.ndarray, shape: tuple[int, int]
) -> sparse.csr_array:
    """Return the sums of weights from source to target, wrapped, without those that are zero."""
    sums = sparse.coo_array((weights.astype(np.int64), (sources, targets)), shape=shape).tocsr()
    sums.data = wrapped(sums.data, SUM_BITS)
    sums.eliminate_zeros()
    return sums
