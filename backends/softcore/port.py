"""The bytes of the host's port of a board with soft cores, see ``softcore/board/host.v``.

A command writes words to a memory; the board answers a command with the number `Target.ANSWER`.
"""

import binascii
from collections.abc import Iterator, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from spikeport.backends.softcore.memory import MemoryImage, Select, wrapped
from spikeport.compile.image.manifest import STATE_BITS
from spikeport.errors import BackendError

CRC_BYTES, CYCLES_BYTES, VALUE_BYTES = 2, 4, 3
MOST_WORDS = (1 << 16) - 1
MOST_CORES = 1 << 7
"""Most cores of a board: an axon has 24 bits, of which 16 name a row, and one marks the last."""
BUFFER_BYTES = 512
"""Bytes that the board can hold while a message waits for the bus."""


class Target(IntEnum):
    """The numbers of targets that are not memories of a core; for these, see `Select`."""

    OUTPUTS = 7
    BUS = 8
    STEP = 9
    ANSWER = 10


class Held(IntEnum):
    """A register of a compartment, or the end of the list of outputs."""

    END = 0
    SPIKE = 1
    U = 2
    V = 3


class Output(NamedTuple):
    """A register of the compartment at a place of a core."""

    held: Held
    core: int
    place: int


WIDTHS: dict[int, int] = {
    Select.CONSTANTS: 6,
    Select.AXONS: 3,
    Select.ROWS: 2,
    Select.PROFILES: 4,
    Select.THRESHOLDS: 3,
    Select.SIZE: 2,
    Select.VOLTAGES: 6,
    Target.OUTPUTS: 4,
    Target.BUS: 3,
    Target.STEP: 1,
    Target.ANSWER: 1,
}
"""Bytes of a word."""

ASK = bytes([Target.ANSWER, 0, 0, 0, 0, 1, 0])
"""The command that is answered once all is quiet."""


def command(target: int, core: int, words: np.ndarray, first: int = 0) -> bytes:
    """Return the bytes that write words to a memory from an address on.

    Parameters
    ----------
    target : int
        A `Select` or a `Target`.
    core : int
        The core whose memory is written.
    words : (n,) array
        Words, of which the lowest `WIDTHS` bytes are written.
    first : int
        The address of the first word.
    """
    parts = []
    for at in range(0, len(words), MOST_WORDS):
        # The high byte goes first, and only as many of the low bytes as the memory's words have.
        part = np.asarray(words[at : at + MOST_WORDS]).astype(">u8")
        octets = part.view(np.uint8).reshape(-1, 8)[:, 8 - WIDTHS[target] :]
        head = bytes([target, core])
        head += (first + at).to_bytes(2, "big") + len(part).to_bytes(2, "big")
        parts.append(head + octets.tobytes())
    return b"".join(parts)


def loading(memory: MemoryImage, outputs: Sequence[Output]) -> bytes:
    """Return the bytes that write a memory image and a list of outputs, values before spikes.

    Cores that the image does not use lose the compartments of an earlier one; a board ignores what
    is written to a core that it does not have.
    """
    parts = [
        command(select, number, words)
        for number, core in enumerate(memory.cores)
        for select, words in core.words
    ]
    unused = range(len(memory.cores), 1 << memory.core_bits)
    parts += [command(Select.SIZE, number, np.zeros(1, dtype=np.int64)) for number in unused]
    entries = [one.held << 24 | one.core << 16 | one.place for one in outputs]
    return b"".join([*parts, command(Target.OUTPUTS, 0, np.array([*entries, Held.END << 24]))])


def stepping(messages: np.ndarray, clear: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a step, in parts that a board without flow control can hold.

    Each part is answered before the next one is sent. ``messages``: (n, 2), core and row.
    """
    begin = command(Target.STEP, 0, np.array([int(clear)]))
    sent = messages[:, 0] << 16 | messages[:, 1]
    # A message takes three bytes.
    most = (BUFFER_BYTES - len(begin) - len(command(Target.BUS, 0, sent[:1])) - len(ASK)) // 3
    for at in range(0, max(len(sent), 1), most):
        yield begin + command(Target.BUS, 0, sent[at : at + most]) + ASK
        begin = b""


class Answer(NamedTuple):
    """An answer of a board.

    Attributes
    ----------
    cycles : int
        Cycles from the beginning of the step until all was quiet.
    values : (n,) array
        The registers of the outputs, in the list's order.
    """

    cycles: int
    values: np.ndarray


def _signed(octets: np.ndarray) -> np.ndarray:
    """Return the values of rows of three bytes, (n,)."""
    return wrapped(octets.astype(np.int64) @ (1 << 16, 1 << 8, 1), STATE_BITS)


def answer_bytes(outputs: Sequence[Output]) -> int:
    """Return the length of an answer with these outputs."""
    spikes = sum(one.held == Held.SPIKE for one in outputs)
    values = VALUE_BYTES * (len(outputs) - spikes)
    return CYCLES_BYTES + values + -(-spikes // 8) + CRC_BYTES


def answered(sent: bytes, received: bytes, outputs: Sequence[Output]) -> Answer:
    """Return the content of an answer.

    Parameters
    ----------
    sent : bytes
        The bytes that were sent since the previous answer.
    received : bytes
        The answer.
    outputs : sequence of Output
        The list of outputs.

    Raises
    ------
    BackendError
        If the board did not receive what was sent, or the answer is damaged or of another length.
    """
    if len(received) != (n_bytes := answer_bytes(outputs)):
        raise BackendError(
            f"the board's answer has {len(received)} bytes, and {n_bytes} belong to its outputs; "
            "cure: load the bitstream that was made for this image"
        )
    content, crc = received[:-CRC_BYTES], int.from_bytes(received[-CRC_BYTES:], "big")
    # CRC-16 with polynomial 0x1021 and initial value 0.
    if binascii.crc_hqx(sent + content, 0) != crc:
        raise BackendError(
            "the board's checksum is not that of the bytes sent and received: the line changed or "
            "lost some; cure: load the bitstream anew, and use a shorter cable"
        )
    cycles, octets = int.from_bytes(content[:CYCLES_BYTES], "big"), content[CYCLES_BYTES:]
    n_values = sum(one.held != Held.SPIKE for one in outputs)
    words = np.frombuffer(octets[: VALUE_BYTES * n_values], dtype=np.uint8)
    values = _signed(words.reshape(-1, VALUE_BYTES))
    spikes = np.unpackbits(np.frombuffer(octets[VALUE_BYTES * n_values :], dtype=np.uint8))
    return Answer(cycles, np.concatenate([values, spikes[: len(outputs) - n_values]]))
