"""Messages as bytes: fixed layouts of CDR, and the checksum over Unitree's C structs.

A message travels as XCDR1, little-endian. CDR aligns every number to its own size, and structs not
at all; C aligns structs too. So the first motor follows the head directly on the wire, and a
message is 4 bytes shorter than the C struct that the checksum is computed over (808 and 1,176 bytes
against 812 and 1,180). The layouts are fixed, so one call of compiled code reads or writes a
message, where cyclonedds takes 1 to 3 ms.

The checksum is CRC-32/MPEG-2 (polynomial 0x04C11DB7, start 0xFFFFFFFF, most significant bit first)
over the struct's little-endian words, without the last, which holds the checksum.
"""

from collections.abc import Iterator

import numpy as np

from spikeport.compiled import compiled, inlined
from spikeport.robot.link.messages import Struct

WORD = 4
POLYNOMIAL = 0x04C11DB7


class MessageError(ValueError):
    """A message with a wrong size, checksum or content."""


def _table() -> np.ndarray:
    """Return the checksums of a word's bytes, ``(4, 256)``; row 3 is for the highest byte."""
    table = np.arange(256, dtype=np.uint32) << 24
    rows = []
    for _ in range(WORD):
        for _ in range(8):
            table = (table << 1) ^ np.where(table >> 31, np.uint32(POLYNOMIAL), np.uint32(0))
        rows.append(table)
    return np.array(rows, dtype=np.uint32)


_TABLE = _table()


@inlined
def _checksum(words: np.ndarray, parts: np.ndarray) -> np.uint32:
    """Return the checksum of a message's words; `parts` as `Layout` makes them."""
    crc = np.uint32(0xFFFFFFFF)
    for i in range(len(parts)):
        crc ^= (words[parts[i, 0]] >> parts[i, 1]) & parts[i, 2]
        crc = (
            _TABLE[3, crc >> 24]
            ^ _TABLE[2, (crc >> 16) & 255]
            ^ _TABLE[1, (crc >> 8) & 255]
            ^ _TABLE[0, crc & 255]
        )
    return crc


@compiled
def _seal(words: np.ndarray, parts: np.ndarray, places: np.ndarray, numbers: np.ndarray) -> None:
    """Write numbers as float32 into words of a message, and its checksum into the last one."""
    floats = words.view(np.float32)
    for i in range(len(places)):
        floats[places[i]] = numbers[i]
    words[-1] = _checksum(words, parts)


@compiled
def _open(words: np.ndarray, parts: np.ndarray, places: np.ndarray, numbers: np.ndarray) -> bool:
    """Read the numbers in words of a message; return True if its checksum is right."""
    floats = words.view(np.float32)
    for i in range(len(places)):
        numbers[i] = floats[places[i]]
    return bool(words[-1] == _checksum(words, parts))


_NO_PLACES, _NO_NUMBERS = np.zeros(0, np.int64), np.zeros(0)


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
        self._parts = self._words_in_c(in_c)
        self.opened(self.sealed(np.zeros(self.size // WORD, "<u4")))  # compiled before it counts

    def _words_in_c(self, in_c: dict[str, int]) -> np.ndarray:
        """Return where each word of the C struct but the last is in the message, ``(n, 3)``.

        A row has the index of a word of the message, the number of its bits to skip, and a mask of
        the other bits to keep: alignment bytes count as zeros, whatever they are.
        """
        parts = np.zeros((self.size_in_c // WORD, 3), np.uint32)
        for path, (at, kind, n) in self._places.items():
            for byte in range(n * np.dtype(kind).itemsize):
                word, place = divmod(in_c[path] + byte, WORD)
                source, skipped = divmod(at + byte, WORD)
                parts[word, :2] = source, 8 * (skipped - place)
                parts[word, 2] |= 0xFF << 8 * place
        return parts[:-1]

    def words(self, *paths: str) -> np.ndarray:
        """Return the indices of the 4-byte words that hold fields, one after the other."""
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
        """Raise MessageError if a message has the wrong size."""
        if len(message) != self.size:
            raise MessageError(f"{self._name}: {len(message)} bytes, not {self.size}")

    def checksum(self, message: bytes) -> int:
        """Return the checksum that a message should have."""
        return int(np.frombuffer(self.sealed(np.frombuffer(message, "<u4").copy()), "<u4")[-1])

    def sealed(
        self,
        message: np.ndarray,
        places: np.ndarray = _NO_PLACES,
        numbers: np.ndarray = _NO_NUMBERS,
    ) -> bytes:
        """Return the bytes of a message, with its checksum.

        Parameters
        ----------
        message : ndarray
            The message's words, ``<u4``; changed in place.
        places, numbers : ndarray
            The words to write into, and the numbers to write as float32.

        Raises
        ------
        ValueError
            If there are more places than numbers, or fewer.
        """
        if len(places) != len(numbers):  # compiled code checks no bounds
            raise ValueError(f"{self._name}: {len(numbers)} numbers for {len(places)} places")
        _seal(message, self._parts, places, numbers)
        return message.tobytes()

    def opened(
        self, message: bytes, places: np.ndarray = _NO_PLACES
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the words of a message, ``<u4``, and the numbers in some of them, float64.

        Raises
        ------
        MessageError
            If its size or checksum is wrong.
        """
        self.check_size(message)
        words, numbers = np.frombuffer(message, "<u4"), np.empty(len(places))
        if not _open(words, self._parts, places, numbers):
            raise MessageError(f"{self._name}: its checksum is wrong")
        return words, numbers


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
    """Return the first byte of each field of a C struct that begins at a byte, and its own end."""
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
