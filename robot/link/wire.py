"""Messages as bytes: fixed layouts of CDR, and the checksum over Unitree's C structs.

A message travels as XCDR1, little-endian. CDR aligns every number to its own size, and structs not
at all; C aligns structs too. So the first motor follows the head directly on the wire, which is 4
bytes shorter than the C struct that the checksum is taken over (808 and 1,176 bytes against 812 and
1,180). The layouts are fixed: reading or writing a message is a few views of its bytes, where
cyclonedds takes 1 to 3 ms.

The checksum is CRC-32/MPEG-2 (polynomial 0x04C11DB7, start 0xFFFFFFFF, most significant bit first)
over the struct's little-endian words, without the last, which holds it.
"""

import zlib
from collections.abc import Iterator

import numpy as np

from spikeport.robot.link.messages import Struct

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
WORD = 4


class MessageError(ValueError):
    """A message that is not what its topic says."""


class Layout:
    """The places of a message's fields.

    Parameters
    ----------
    struct : Struct
        The message.

    Attributes
    ----------
    size : int
        Bytes of the message, without the 4 that say how it is encoded.
    size_in_c : int
        Bytes of the C struct.
    """

    def __init__(self, struct: Struct) -> None:
        self._name = struct.name
        self._places = {path: (at, kind, n) for path, kind, n, at in _packed(struct.leaves())}
        at, kind, n = next(reversed(self._places.values()))
        self.size = at + n * np.dtype(kind).itemsize
        in_c, self.size_in_c = _in_c(struct)
        self._sources = self._words_in_c(in_c)

    def _words_in_c(self, in_c: dict[str, int]) -> np.ndarray:
        """Return which byte of the message is each of the C struct, highest of a word first.

        Bytes that align are zeros, which lie behind the message.
        """
        sources = np.full(self.size_in_c, self.size)
        for path, (at, kind, n) in self._places.items():
            length = n * np.dtype(kind).itemsize
            sources[in_c[path] : in_c[path] + length] = np.arange(at, at + length)
        return sources.reshape(-1, WORD)[:-1, ::-1].ravel()

    def words(self, *paths: str) -> np.ndarray:
        """Return the numbers of the 4-byte words that hold fields, one after the other."""
        found: list[int] = []
        for path in paths:
            at, kind, n = self._places[path]
            assert np.dtype(kind).itemsize == WORD, path
            found += range(at // WORD, at // WORD + n)
        return np.array(found)

    def at(self, path: str) -> int:
        """Return the byte at which a field begins."""
        return self._places[path][0]

    def check_size(self, message: bytes) -> None:
        """Raise MessageError if a message has another size."""
        if len(message) != self.size:
            raise MessageError(f"{self._name}: {len(message)} bytes, not {self.size}")

    def checksum(self, message: bytes) -> int:
        """Return the checksum that a message is to have."""
        padded = np.frombuffer(message + b"\0", np.uint8)
        # zlib's CRC is the same one from the least significant bit on: bits are reversed twice
        crc = zlib.crc32(padded[self._sources].tobytes().translate(_REVERSED)) ^ 0xFFFFFFFF
        return int(f"{crc:032b}"[::-1], 2)

    def sealed(self, message: np.ndarray) -> bytes:
        """Return the bytes of a message (words of ``<u4``), with its checksum in the last word."""
        message[-1] = self.checksum(message.tobytes())
        return message.tobytes()

    def opened(self, message: bytes) -> np.ndarray:
        """Return the words of a message, ``<u4``; raises MessageError if its checksum is wrong."""
        self.check_size(message)
        words = np.frombuffer(message, "<u4")
        if words[-1] != self.checksum(message):
            raise MessageError(f"{self._name}: its checksum is wrong")
        return words


def _packed(
    leaves: Iterator[tuple[str, str, int]], begin: int = 0
) -> Iterator[tuple[str, str, int, int]]:
    """Yield path, type, length and first byte of fields that are each aligned to their size."""
    for path, kind, n in leaves:
        size = np.dtype(kind).itemsize
        # Rounded up to a multiple of the size.
        begin = -(-begin // size) * size
        yield path, kind, n, begin
        begin += n * size


def _in_c(struct: Struct, prefix: str = "", begin: int = 0) -> tuple[dict[str, int], int]:
    """Return the first byte of each field of a C struct that begins at a byte, and its end."""
    places: dict[str, int] = {}
    at = _aligned(begin, _alignment(struct))
    for name, kind, length in struct.fields:
        if isinstance(kind, str):
            at = _aligned(at, np.dtype(kind).itemsize)
            places[f"{prefix}{name}"] = at
            at += max(length, 1) * np.dtype(kind).itemsize
            continue
        for path in [f"{name}[{i}]" for i in range(length)] if length else [name]:
            inner, at = _in_c(kind, f"{prefix}{path}.", at)
            places |= inner
    return places, _aligned(at, _alignment(struct))


def _alignment(struct: Struct) -> int:
    return max(np.dtype(kind).itemsize for _, kind, _ in struct.leaves())


def _aligned(at: int, size: int) -> int:
    return -(-at // size) * size
