"""The encoding of Protocol Buffers: fields with numbers, of four kinds.

Fields become values only when they are read: a message of millions of empty messages stays bytes.
"""

import struct
from collections.abc import Iterator

FIELDS = 100_000
"""The most fields of a file; a policy's graph has some hundreds, with one for each weight array."""

# 3 and 4 began and ended groups, which Protocol Buffers deprecated and ONNX never had.
VARINT, LONG, BYTES, SHORT = 0, 1, 2, 5
FIXED = {LONG: 8, SHORT: 4}

Value = int | memoryview


class WireError(ValueError):
    """Error for bytes that are not a message of Protocol Buffers."""


class FieldBudget:
    """The number of fields that a file may still have."""

    def __init__(self, fields: int = FIELDS) -> None:
        self._left = fields

    def spend(self) -> None:
        """Count a field."""
        self._left -= 1
        if self._left < 0:
            raise WireError(f"more than {FIELDS:,} fields")


class Message:
    """A message: its fields by number, in their order in the file.

    Raises
    ------
    WireError
        The message ends within a field, a field has another kind, or the file has too many fields.
    """

    def __init__(self, content: bytes | memoryview, budget: FieldBudget | None = None) -> None:
        self._budget = budget or FieldBudget()
        self._fields: dict[int, list[Value]] = {}
        for number, value in _fields(memoryview(content)):
            self._budget.spend()
            self._fields.setdefault(number, []).append(value)

    def __contains__(self, number: int) -> bool:
        return number in self._fields

    def number(self, field: int, default: int = 0) -> int:
        """Return a whole number; the last one counts, as in other parsers."""
        value = self._fields.get(field, [default])[-1]
        if not isinstance(value, int):
            raise WireError("bytes in place of a number")
        # Negative numbers are stored as their two's complement of 64 bits.
        return value if value < 2**63 else value - 2**64

    def numbers(self, field: int) -> list[int]:
        """Return whole numbers, stored one by one or packed."""
        found: list[int] = []
        for value in self._fields.get(field, []):
            found += [value] if isinstance(value, int) else self._packed(value)
        return [value if value < 2**63 else value - 2**64 for value in found]

    def _packed(self, content: memoryview) -> list[int]:
        found, place = [], 0
        while place < len(content):
            self._budget.spend()
            value, place = _varint(content, place)
            found.append(value)
        return found

    def real(self, field: int, default: float = 0.0) -> float:
        """Return a number of 32 bits."""
        values = self.contents(field)
        if not values:
            return default
        if len(values[-1]) != FIXED[SHORT]:
            raise WireError(f"{len(values[-1])} bytes in place of a 32-bit number")
        value: float = struct.unpack("<f", values[-1])[0]
        return value

    def contents(self, field: int) -> list[memoryview]:
        """Return the bytes of every field of this number."""
        values = self._fields.get(field, [])
        if any(isinstance(value, int) for value in values):
            raise WireError("a number in place of bytes")
        return [value for value in values if isinstance(value, memoryview)]

    def content(self, field: int) -> memoryview:
        """Return the bytes of a field, or no bytes if it is absent."""
        return (self.contents(field) or [memoryview(b"")])[-1]

    def texts(self, field: int) -> list[str]:
        """Return the texts of every field of this number."""
        try:
            return [str(value, "utf-8") for value in self.contents(field)]
        except UnicodeDecodeError:
            raise WireError("a text that is not UTF-8") from None

    def text(self, field: int) -> str:
        """Return a text, or an empty one if it is absent."""
        return (self.texts(field) or [""])[-1]

    def messages(self, field: int) -> Iterator["Message"]:
        """Yield the messages of every field of this number."""
        return (Message(content, self._budget) for content in self.contents(field))


def _fields(content: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    place = 0
    while place < len(content):
        key, place = _varint(content, place)
        number, kind = key >> 3, key & 7
        if kind == VARINT:
            value, place = _varint(content, place)
            yield number, value
            continue
        size = FIXED.get(kind, 0)
        if kind == BYTES:
            size, place = _varint(content, place)
        elif kind not in FIXED:
            raise WireError(f"a field of kind {kind}")
        if size > len(content) - place:
            raise WireError(f"a field of {size:,} bytes where {len(content) - place:,} are left")
        yield number, content[place : place + size]
        place += size


def _varint(content: memoryview, place: int) -> tuple[int, int]:
    """Return a number that is stored in groups of seven bits, and the place after it."""
    value = 0
    # 64 bits take ten groups; parsers of Protocol Buffers drop any further bits of the tenth.
    for shift in range(0, 70, 7):
        if place >= len(content):
            break
        byte = content[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & (2**64 - 1), place
    raise WireError("a number without an end")
