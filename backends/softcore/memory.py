"""The memories of a soft core: layouts of their words, as in ``hardware_models/softcore/*.v``."""

import hashlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

LOG_COMPARTMENTS = 10
ROW_BITS = 16
ROW_WORDS = 1 << ROW_BITS
AXONS = 4096
PROFILES, THRESHOLDS = 32, 32


class Select(IntEnum):
    """The memories of a core, by the number that the host addresses them with."""

    CONSTANTS = 0
    AXONS = 1
    ROWS = 2
    PROFILES = 3
    THRESHOLDS = 4
    SIZE = 5
    VOLTAGES = 6


class CoreMemory(NamedTuple):
    """The contents of the memories of one core, as unsigned words of 64 bits."""

    constants: np.ndarray
    """{sends 1, axon 12, threshold 5, profile 5, bias 24} of each compartment."""
    axons: np.ndarray
    """{last 1, core, row 16}."""
    rows: np.ndarray
    """16-bit words, see ``walker.v``."""
    profiles: np.ndarray
    """{delay 6, keep_v 13, keep_u 12}."""
    thresholds: np.ndarray
    voltages: np.ndarray
    """One word {vmin 24, vmax 24}."""

    @property
    def words(self) -> Iterator[tuple[Select, np.ndarray]]:
        """Contents of each memory, with its number."""
        yield Select.CONSTANTS, self.constants
        yield Select.AXONS, self.axons
        yield Select.ROWS, self.rows
        yield Select.PROFILES, self.profiles
        yield Select.THRESHOLDS, self.thresholds
        yield Select.SIZE, np.array([len(self.constants)], dtype=np.uint64)
        yield Select.VOLTAGES, self.voltages


@dataclass(frozen=True)
class MemoryImage:
    """An image as the host writes it into soft cores.

    Attributes
    ----------
    cores : tuple of CoreMemory
        The memories of each core.
    host_start : (n_inputs + 1,) int array
        Start of each host source's messages in ``host_messages``.
    host_messages : (n, 2) int array
        Core and row of each message.
    order : (n_compartments,) int array
        The image's number of each compartment, core by core.
    unit : int
        Sums are in units of 2^unit, so that they need that many bits less.
    core_bits : int
        Bits of the number of a core in an axon.
    """

    cores: tuple[CoreMemory, ...]
    host_start: np.ndarray
    host_messages: np.ndarray
    order: np.ndarray
    unit: int
    core_bits: int

    @property
    def first(self) -> np.ndarray:
        """Compartments before each core, in `order`, (n_cores,)."""
        sizes = [len(core.constants) for core in self.cores]
        return np.cumsum([0, *sizes[:-1]])

    def entries(self) -> np.ndarray:
        """Return the words that the host writes: core, memory, address, both halves, (n, 5)."""
        parts = [
            np.column_stack(
                [
                    np.full(len(words), number),
                    np.full(len(words), select),
                    np.arange(len(words)),
                    words & 0xFFFFFFFF,
                    words >> 32,
                ]
            )
            for number, core in enumerate(self.cores)
            for select, words in core.words
        ]
        return np.concatenate(parts).astype(np.uint32)

    def messages(self, sources: np.ndarray) -> np.ndarray:
        """Return the messages of the host's sources that spike, (n, 2)."""
        parts = [self.host_messages[self.host_start[s] : self.host_start[s + 1]] for s in sources]
        return np.concatenate(parts) if parts else self.host_messages[:0]

    def messages_by_source(self) -> list[list[tuple[int, int]]]:
        """Return core and row of each message that a spike of a source sends, by source.

        Sources are the image's compartments, in its order, then those on the host.
        """
        n = len(self.order)
        lists: list[list[tuple[int, int]]] = [[] for _ in range(n)]
        mask = (1 << self.core_bits) - 1
        for first, core in zip(self.first, self.cores, strict=True):
            for local, word in enumerate(core.constants.tolist()):
                # As laid out in `CoreMemory.constants`: axon from bit 34 on, sends at bit 46.
                at, more = word >> 34 & 0xFFF, bool(word >> 46)
                while more:
                    axon = int(core.axons[at])
                    found = axon >> ROW_BITS & mask, axon & ((1 << ROW_BITS) - 1)
                    lists[self.order[first + local]].append(found)
                    # Axons of a compartment follow each other; the last one's top bit is set.
                    at, more = at + 1, not axon >> (ROW_BITS + self.core_bits)
        host = [(core, row) for core, row in self.host_messages.tolist()]
        ends = self.host_start.tolist()
        return lists + [host[begin:end] for begin, end in itertools.pairwise(ends)]

    @property
    def digest(self) -> str:
        """SHA-256 of everything that the host writes, and of its table of messages."""
        found = hashlib.sha256()
        for array in (self.entries(), self.host_start, self.host_messages, self.unit):
            # One byte order, so that the digest is the same on any machine.
            content = np.asarray(array).astype("<u4")
            found.update(f"{content.shape}".encode() + content.tobytes())
        return found.hexdigest()


def core_bits(n_cores: int) -> int:
    """Return the bits of the number of a core."""
    return max(1, (n_cores - 1).bit_length())


def wrapped(values: np.ndarray, bits: int) -> np.ndarray:
    """Return integers as registers of ``bits`` bits hold them, in two's complement."""
    half = 1 << (bits - 1)
    result: np.ndarray = (np.asarray(values, dtype=np.int64) + half) % (2 * half) - half
    return result
