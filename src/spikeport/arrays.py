"""Types of arrays, by their elements, addresses, and numbers for equal parts of an array."""

import ctypes
import itertools

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return the address of an array, for a function in C; the address keeps the array alive."""
    return array.ctypes.data_as(ctypes.c_void_p)


def number_alike(values: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Number the parts that ``start`` divides ``values`` into; equal parts get equal numbers."""
    # Bytes compare in one operation, whatever the length of a part.
    content = values.tobytes()
    width = values.nbytes // max(len(values), 1)
    known: dict[bytes, int] = {}
    bounds = itertools.pairwise((start.astype(np.int64) * width).tolist())
    return np.array([known.setdefault(content[a:b], len(known)) for a, b in bounds], dtype=int)
