"""NumPy's archives of arrays, read within limits: numbers and texts, and never objects."""

import io
import math
import sys
import tokenize
import warnings
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from spikeport.reading.archive import FILE_BYTES, MOST_NUMBERS, Archive, read_bytes
from spikeport.reading.mismatch import MismatchError, first_line

SUFFIX = ".npy"
MAX_AXES = 8
"""Axes of an array: a weight has two."""
HEADER_BYTES = 10_000
"""Longest header of an array: NumPy's own limit, above which reading its type might take long."""

DAMAGES = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    SyntaxError,
    tokenize.TokenError,
    RecursionError,
    MemoryError,
    SystemError,  # Python 3.12.1's tokenizer raises it for some headers
)
"""Errors of a damaged header: NumPy reads it with Python's own parser."""

KINDS = "biufU"
"""Types of arrays: truth values, numbers and texts, by NumPy's letters."""


def read(path: Path, most: int = MOST_NUMBERS, limit: int = FILE_BYTES) -> dict[str, np.ndarray]:
    """Return the arrays of a file by name.

    Parameters
    ----------
    path : Path
        The file.
    most : int
        Most numbers of an array, and its longest axis.
    limit : int
        Most bytes of the file, and of its inflated content.

    Raises
    ------
    MismatchError
        If it is not such an archive, damaged, too large, or holds anything but numbers and texts.
    """
    content = read_bytes(path, limit)
    if content.startswith(npy.MAGIC_PREFIX):
        raise MismatchError("an archive of arrays (.npz)", "a single array (.npy)")
    archive = Archive(content, limit)
    return {name.removesuffix(SUFFIX): _array(archive, name, most) for name in archive.names}


def _array(archive: Archive, name: str, most: int) -> np.ndarray:
    content = archive.read(name, HEADER_BYTES + 8 * most)
    stream = io.BytesIO(content)
    try:
        with warnings.catch_warnings(action="ignore"):  # about headers of old versions
            shape, columns, kind = _header(stream)
    except DAMAGES as error:
        raise MismatchError(f"an array {name}", f"none ({first_line(error)})") from error
    if kind.kind not in KINDS:
        raise MismatchError(f"numbers or texts in {name}", f"type {kind}")
    if len(shape) > MAX_AXES:
        raise MismatchError(f"an array of at most {MAX_AXES} axes in {name}", f"{len(shape)}")
    for length in shape:
        if not 0 <= length <= most:
            raise MismatchError(f"axes of 0 to {most:,} in {name}", f"{length:,}")
    values = content[stream.tell() :]
    if not kind.itemsize or math.prod(shape) * kind.itemsize != len(values):
        raise MismatchError(f"{math.prod(shape):,} values of {kind} in {name}", "another size")
    if kind.kind == "U" and not _is_text(np.frombuffer(values, f"{kind.byteorder}u4")):
        raise MismatchError(f"Unicode letters in {name}", "invalid code points")
    return np.frombuffer(values, kind).reshape(shape, order="F" if columns else "C")


def _is_text(letters: np.ndarray) -> bool:
    """Return whether numbers are letters of Unicode, and no surrogates."""
    halves = (letters >= 0xD800) & (letters < 0xE000)
    return not (halves | (letters > sys.maxunicode)).any()


def _header(stream: io.BytesIO) -> tuple[tuple[int, ...], bool, np.dtype[np.generic]]:
    """Return an array's shape, whether it is in Fortran order, and its type."""
    version = npy.read_magic(stream)
    if version == (1, 0):
        return npy.read_array_header_1_0(stream, HEADER_BYTES)
    return npy.read_array_header_2_0(stream, HEADER_BYTES)
