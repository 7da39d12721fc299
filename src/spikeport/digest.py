"""Digests of values: equal for equal values, in every process."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import PurePath

import numpy as np
from pydantic import BaseModel


def digest_of(value: object) -> str:
    """Return the SHA-256 of a value in an encoding that is the same in every process.

    It takes None, truth values, numbers, texts, bytes, paths and arrays, and sequences, mappings
    with texts as keys, dataclasses and models of pydantic that are made of them. Every part goes in
    with its type and size, so that no two values share an encoding.

    Raises
    ------
    TypeError
        If a part is of another type, as a function: its identity ends with the process.
    """
    found = hashlib.sha256()
    for part in _parts(value):
        # With their lengths: "ab", "c" and "a", "bc" are different values.
        found.update(len(part).to_bytes(8, "little"))
        found.update(part)
    return found.hexdigest()


def _parts(value: object) -> Iterator[bytes]:
    """Yield the parts of a value's encoding."""
    yield type(value).__qualname__.encode()
    match value:
        case None | bool() | int() | float() | str() | PurePath():
            yield repr(value).encode()
        case bytes():
            yield value
        case np.ndarray() | np.generic():
            array = np.asarray(value)
            if array.dtype.hasobject:
                raise TypeError("an array of Python objects has no identity that lasts")
            yield f"{array.dtype.str} {array.shape}".encode()
            yield array.tobytes()
        case Mapping():
            if not all(isinstance(name, str) for name in value):
                raise TypeError("a mapping with other keys than texts has no identity that lasts")
            yield from _parts([[name, value[name]] for name in sorted(value)])
        case list() | tuple():
            yield str(len(value)).encode()
            for part in value:
                yield from _parts(part)
        case BaseModel():
            yield from _parts(dict(value))
        case _ if is_dataclass(value) and not isinstance(value, type):
            yield from _parts({one.name: getattr(value, one.name) for one in fields(value)})
        case _:
            raise TypeError(f"{type(value).__qualname__} has no identity that lasts: {value!r}")
