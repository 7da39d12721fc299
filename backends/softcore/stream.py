"""The bytes of the host's port, for a board with a serial line; see ``host.v``."""

from collections.abc import Iterator, Sequence
from enum import IntEnum

import numpy as np

from spikeport.backends.softcore.memory import VALUE_BITS, MemoryImage, wrapped

ANSWER_BYTES = 3


class Command(IntEnum):
    """The first byte of a command."""

    DATA = 1
    WRITE = 2
    MESSAGE = 3
    STEP = 4
    WAIT = 5
    READ = 6


class Held(IntEnum):
    """What a read answers with."""

    U = 0
    V = 1
    SPIKE = 2


def loading(memory: MemoryImage) -> bytes:
    """Return what writes a memory image, and sets all state to zero; it has two answers."""
    return b"".join([*map(_word, memory.entries()), *[_command(Command.STEP, 1), wait()] * 2])


def step(messages: np.ndarray) -> bytes:
    """Return what begins a step, with its messages of the host, (n, 2): core and row."""
    sent = [_command(Command.MESSAGE, core << 16 | row) for core, row in messages.tolist()]
    return b"".join([_command(Command.STEP, 0), *sent])


def wait() -> bytes:
    """Return what is answered with the cycles of the step, once it is over."""
    return _command(Command.WAIT, 0)


def read(core: int, what: Held, first: int, n: int) -> bytes:
    """Return what is answered with n values of compartments of a core."""
    return _data(n) + _command(Command.READ, core << 19 | what << 16 | first)


def answers(content: bytes) -> np.ndarray:
    """Return the values of answers, each of 24 bits, signed."""
    octets = np.frombuffer(content, dtype=np.uint8).reshape(-1, ANSWER_BYTES).astype(np.int64)
    return wrapped(octets @ (1, 1 << 8, 1 << 16), VALUE_BITS)


def _word(entry: Sequence[int]) -> bytes:
    core, select, at, low, high = map(int, entry)
    address = core << 19 | select << 16 | at
    return _data(high << 32 | low) + _command(Command.WRITE, address)


def _data(value: int) -> bytes:
    """Return what puts a value of up to 48 bits into the data register."""
    return b"".join(_command(Command.DATA, part) for part in _halves(value))


def _halves(value: int) -> Iterator[int]:
    yield value >> 24
    yield value & 0xFFFFFF


def _command(what: Command, content: int) -> bytes:
    return bytes([what]) + content.to_bytes(3, "big")
