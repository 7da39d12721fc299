"""Ways to spoil a file: bytes anywhere, or in a member of an archive that is valid otherwise."""

import io
import random
import zipfile
from collections.abc import Callable

TELLING = (0x00, 0x01, 0x7F, 0x80, 0xFF, 0x0A, 0x22, 0x28, 0x2E, 0x5B, 0x7B)
"""Bytes with a meaning in many formats: ends, signs, line feeds, quotes, brackets."""

MOST = 64
"""The most bytes that are cut, doubled or inserted at once."""


def _flip(data: bytearray, rng: random.Random) -> None:
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _put(data: bytearray, rng: random.Random) -> None:
    data[rng.randrange(len(data))] = rng.choice(TELLING)


def _number(data: bytearray, rng: random.Random) -> None:
    """Replace four bytes by a number at the limits of 32-bit integers."""
    place = rng.randrange(len(data))
    data[place : place + 4] = rng.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1)).to_bytes(4, "little")


def _cut(data: bytearray, rng: random.Random) -> None:
    place = rng.randrange(len(data))
    del data[place : place + rng.randint(1, MOST)]


def _double(data: bytearray, rng: random.Random) -> None:
    place = rng.randrange(len(data))
    data[place:place] = data[place : place + rng.randint(1, MOST)] * rng.choice((1, 1, 50))


def _insert(data: bytearray, rng: random.Random) -> None:
    place = rng.randrange(len(data) + 1)
    data[place:place] = rng.randbytes(rng.randint(1, MOST))


def _move(data: bytearray, rng: random.Random) -> None:
    start, place, size = rng.randrange(len(data)), rng.randrange(len(data)), rng.randint(1, MOST)
    data[place : place + size] = data[start : start + size]


def _truncate(data: bytearray, rng: random.Random) -> None:
    del data[rng.randrange(len(data)) :]


WAYS: tuple[Callable[[bytearray, random.Random], None], ...] = (
    *(_flip, _flip, _put, _number, _cut, _double, _insert, _move),
    _truncate,
)


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Return a file's content, spoilt; more than half of all archives within a member."""
    if content.startswith(b"PK") and rng.random() < 0.6:
        return _within(content, rng)
    return _spoilt(content, rng)


def _spoilt(content: bytes, rng: random.Random) -> bytes:
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4))):
        if data:
            rng.choice(WAYS)(data, rng)
    return bytes(data)


def _within(content: bytes, rng: random.Random) -> bytes:
    """Spoil a member and pack the archive again, so that its sizes and checksums are valid."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = rng.choice([name for name, value in members.items() if value])
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as archive:
        for other, value in members.items():
            archive.writestr(other, _spoilt(value, rng) if other == name else value)
    return written.getvalue()
