"""Reads a drawn digit: a support vector machine trained on scikit-learn's 8 x 8 digits.

A trace is made into a picture the way that data set was: a thick stroke in a 32 x 32 bitmap, which
the digit fills from top to bottom, centred; then 4 x 4 blocks of it are counted, which gives 8 x 8
numbers from 0 to 16.

Source: Alpaydin and Kaynak, Optical Recognition of Handwritten Digits, UCI repository, 1998.
"""

from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from spikeport.extras import missing

if TYPE_CHECKING:
    from sklearn.svm import SVC

BITMAP, BLOCK = 32, 4
PEN = 2.0
"""Half the width of the stroke, in cells of the bitmap; the data set's strokes are about 4 wide."""


def can_read() -> bool:
    """Return whether the package that reads is there."""
    return find_spec("sklearn") is not None


def read_digit(trace: np.ndarray) -> int:
    """Return the digit that a trace (n, 2) looks like; its first axis runs right, its second up.

    Raises
    ------
    MissingExtraError
        If scikit-learn is absent.
    """
    return int(_reader().predict(rasterise(trace).reshape(1, -1))[0])


def rasterise(trace: np.ndarray) -> np.ndarray:
    """Return (8, 8) picture from 0 to 16 of a trace (n, 2), first row on top."""
    low, high = trace.min(axis=0), trace.max(axis=0)
    # The longer side fills the bitmap, but for half a stroke at each end.
    scale = (BITMAP - 2 * PEN) / (high - low).max()
    cells = np.arange(BITMAP) + 0.5
    across, down = np.meshgrid(cells, cells)
    # Cells of the bitmap in the trace's metres, rows from top to bottom.
    grid = np.stack([across - BITMAP / 2, BITMAP / 2 - down], axis=-1) / scale + (low + high) / 2
    distance, _ = cKDTree(trace).query(grid)
    inked = distance * scale <= PEN
    counted = inked.reshape(BITMAP // BLOCK, BLOCK, -1, BLOCK).sum(axis=(1, 3))
    return np.asarray(counted, dtype=float)


def require() -> None:
    """Raise `MissingExtraError` if the package that reads is absent."""
    if not can_read():
        raise missing("reading digits", "scikit-learn", "digits")


@cache
def _reader() -> "SVC":
    require()
    from sklearn.datasets import load_digits
    from sklearn.svm import SVC

    digits = load_digits()
    # scikit-learn's own example for this data set has this gamma.
    return SVC(gamma=0.001).fit(digits.data, digits.target)
