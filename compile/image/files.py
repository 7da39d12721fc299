"""The file of an image: a zip archive of NumPy's arrays, and a header of JSON.

A file may come from anywhere, so nothing in it is trusted before it is checked against the archive:
an array must be as large as its bytes, and an archive that would inflate out of all proportion is
not inflated at all.
"""

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy

from spikeport.atomic import atomic_path
from spikeport.compile.image.manifest import Header, read_header
from spikeport.compile.image.tables import LAYOUT
from spikeport.errors import ImageError
from spikeport.reading.archive import Archive, UnreadableError, read_bytes
from spikeport.reading.mismatch import MismatchError
from spikeport.reading.text import TEXT_BYTES

HEADER = "header"
SMALL_BYTES = 64 << 20
"""Size to which any archive may inflate, since arrays of zeros take next to no room in a file."""
MOST_RATIO = 100
"""The largest ratio by which a larger archive may inflate. Images of networks stay below 30."""
FILE_BYTES = 2 << 30
"""Size of the largest file that is read: the images of a hundred full chips."""
DAMAGED = "not a chip image, or truncated or altered"


def write(path: Path, header: bytes, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a file, whole or not at all."""
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        pack(file, header, arrays)


def pack(file: IO[bytes], header: bytes, arrays: Mapping[str, np.ndarray]) -> None:
    """Write the content of a file."""
    members: dict[str, Any] = {HEADER: np.frombuffer(header, np.uint8), **arrays}
    np.savez_compressed(file, **members)


def read(path: Path) -> tuple[Header, dict[str, np.ndarray]]:
    """Read the header and the arrays of a file.

    Raises
    ------
    ImageError
        If the file is missing, or was not made by `write`.
    """
    try:
        return parse(read_bytes(path, FILE_BYTES))
    except UnreadableError as error:
        raise ImageError(error.reason) from None
    except MismatchError:
        raise ImageError(DAMAGED) from None


def parse(content: bytes) -> tuple[Header, dict[str, np.ndarray]]:
    """Return the header and the arrays in the bytes of a file; ImageError if they hold none."""
    try:
        return _parse(content)
    except ImageError:
        raise
    except Exception:  # a mismatch, or any error that NumPy raises at foreign bytes
        raise ImageError(DAMAGED) from None


def _parse(content: bytes) -> tuple[Header, dict[str, np.ndarray]]:
    most = max(SMALL_BYTES, MOST_RATIO * len(content))
    archive = Archive(content, most)
    if archive.size > most:
        raise ImageError(
            f"a file of {len(content):,} bytes that inflates to {archive.size:,}, limit {most:,}: "
            "no image of a network does; compile it again"
        )

    def array(name: str, limit: int = most) -> np.ndarray:
        return _array(io.BytesIO(archive.read(f"{name}.npy", limit)), name)

    # The header first: an image of another schema may have other arrays.
    header = read_header(array(HEADER, TEXT_BYTES).tobytes())
    names = [name.removesuffix(".npy") for name in archive.names]
    return header, {name: array(name) for name in names if name != HEADER}


def _array(stream: IO[bytes], name: str) -> np.ndarray:
    """Return an array, after a check of its type with the layout and its size with its bytes."""
    if npy.read_magic(stream) != (1, 0):
        raise ImageError(DAMAGED)
    shape, in_fortran_order, dtype = npy.read_array_header_1_0(stream)
    wanted = LAYOUT[name].dtype if name in LAYOUT else "|u1"
    if dtype.str != wanted:
        raise ImageError(f"array {name} is of type {dtype.str}, not {wanted}; compile it again")
    data = stream.read()
    if in_fortran_order or math.prod(shape) * dtype.itemsize != len(data):
        raise ImageError(DAMAGED)
    return np.frombuffer(data, dtype).reshape(shape)
