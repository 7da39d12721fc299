"""Tensors of ONNX files as arrays, from bytes in the model or in a file beside it."""

import math
import os
import re
import stat
from pathlib import Path

import numpy as np

from spikeport.networks.loading.wire import Message
from spikeport.reading.archive import MOST_NUMBERS
from spikeport.reading.mismatch import MismatchError
from spikeport.reading.npz import MAX_AXES

# Fields of a TensorProto, by their numbers in ONNX's onnx.proto.
DIMS, TYPE, SEGMENT, FLOATS, INTS, LONGS = 1, 2, 3, 4, 5, 7
NAME, RAW, DOUBLES, EXTERNAL, LOCATION = 8, 9, 10, 13, 14
# Fields of a StringStringEntryProto: the place of numbers that are not in the model.
KEY, VALUE = 1, 2

FLOAT, DOUBLE, INT64, FLOAT16, BFLOAT16 = 1, 11, 7, 10, 16
TYPES = {
    FLOAT: "<f4",
    2: "u1",
    3: "i1",
    4: "<u2",
    5: "<i2",
    6: "<i4",
    INT64: "<i8",
    9: "?",
    FLOAT16: "<f2",
    DOUBLE: "<f8",
    12: "<u4",
    13: "<u8",
    BFLOAT16: "<u2",
}
"""NumPy's types by ONNX's numbers of types; a bfloat16 is the upper half of a float32."""

WHOLE = "iub"
"""NumPy's kinds of integers and truth values."""
INTEGERS = (2, 3, 4, 5, 6, 9)
"""Types whose numbers may be in a field for integers of 32 bits."""


def array(tensor: Message, path: Path) -> np.ndarray:
    """Return the values of a tensor of the model at a path: floats, or integers of any size.

    Raises
    ------
    MismatchError
        The values are not numbers, do not fit the shape, or are in a file that is not beside the
        model.
    """
    name, kind = tensor.text(NAME), tensor.number(TYPE)
    shape = tensor.numbers(DIMS)
    if kind not in TYPES:
        raise MismatchError(f"numbers in {name}", f"values of type {kind}")
    if len(shape) > MAX_AXES or any(not 0 <= n <= MOST_NUMBERS for n in shape):
        raise MismatchError(
            f"at most {MAX_AXES} axes, each from 0 to {MOST_NUMBERS:,}, in {name}", "other sizes"
        )
    count = math.prod(shape)
    if count > MOST_NUMBERS:
        raise MismatchError(f"at most {MOST_NUMBERS:,} numbers in {name}", f"{count:,}")
    values = _values(tensor, kind, path, count)
    if len(values) != count:
        raise MismatchError(f"{count:,} numbers in {name}", f"{len(values):,}")
    return (
        values.reshape(shape) if values.dtype.kind in WHOLE else values.astype(float).reshape(shape)
    )


def _values(tensor: Message, kind: int, path: Path, count: int) -> np.ndarray:
    if SEGMENT in tensor:
        raise MismatchError("a whole tensor", f"a segment of {tensor.text(NAME)}")
    if tensor.number(LOCATION) or EXTERNAL in tensor:
        # A file beside the model may have any length: only the bytes of the shape are read.
        size = count * np.dtype(TYPES[kind]).itemsize
        return _numbers(_beside(tensor, path, size), kind)
    if kind == FLOAT and FLOATS in tensor:
        return in_field(tensor, FLOATS, kind)
    if kind == DOUBLE and DOUBLES in tensor:
        return in_field(tensor, DOUBLES, kind)
    if kind in (FLOAT16, BFLOAT16) and INTS in tensor:
        return _half_precision(tensor, kind)
    if kind == INT64 and LONGS in tensor:
        return np.array(tensor.numbers(LONGS))
    if kind in INTEGERS and INTS in tensor:
        return np.array(tensor.numbers(INTS))
    return _numbers(tensor.content(RAW), kind)


def in_field(message: Message, field: int, kind: int) -> np.ndarray:
    """Return the numbers in a field for one type.

    Packed or one by one, the numbers are the same bytes, with the low byte first.
    """
    return _numbers(b"".join(message.contents(field)), kind)


def _half_precision(tensor: Message, kind: int) -> np.ndarray:
    """Return numbers of 16 bits, each stored as a whole number."""
    bits = tensor.numbers(INTS)
    if any(not 0 <= one < 2**16 for one in bits):
        raise MismatchError(f"numbers of 16 bits in {tensor.text(NAME)}", "larger ones")
    return _numbers(np.array(bits, "<u2").tobytes(), kind)


def _numbers(content: bytes | memoryview, kind: int) -> np.ndarray:
    size = np.dtype(TYPES[kind]).itemsize
    if len(content) % size:
        raise MismatchError(f"a multiple of {size} bytes", f"{len(content):,} bytes")
    numbers = np.frombuffer(content, TYPES[kind])
    if kind == BFLOAT16:
        return (numbers.astype(np.uint32) << 16).view(np.float32)
    return numbers


def location(tensor: Message) -> str:
    """Return the name of the file that a tensor's bytes are in; empty if they are in the model."""
    return _entries(tensor).get("location", "")


def is_neighbour(location: str) -> bool:
    """Return whether a location is the name of a file beside the model, not a path elsewhere."""
    return location not in ("", ".", "..") and not re.search(r"[/\\\0]", location)


def _entries(tensor: Message) -> dict[str, str]:
    return {entry.text(KEY): entry.text(VALUE) for entry in tensor.messages(EXTERNAL)}


def _beside(tensor: Message, path: Path, size: int) -> bytes:
    """Return the bytes of a tensor from another file, which must be beside the model."""
    entries = _entries(tensor)
    location, start = entries.get("location", ""), entries.get("offset", "0")
    if not is_neighbour(location):
        raise MismatchError("numbers in a file beside the model", f"'{location}'")
    # `int` alone would accept signs, blanks, underscores, and offsets beyond any file.
    if not re.fullmatch("[0-9]{1,15}", start):
        raise MismatchError(f"an offset into {location}", start)
    try:
        return _read(path.with_name(location), int(start), size)
    except OSError as error:
        raise MismatchError(f"numbers in {location}", f"none ({error.strerror})") from error


def _read(path: Path, start: int, size: int) -> bytes:
    with open(path, "rb", opener=_no_link) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise MismatchError(f"a file {path.name}", "a pipe or a device")
        file.seek(start)
        return file.read(size)


def _no_link(path: str, flags: int) -> int:
    """Open a file unless it is a link, and do not wait for a pipe."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)
