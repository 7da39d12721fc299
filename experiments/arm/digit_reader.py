"""A reader of drawn digits: a support vector machine trained on scikit-learn's 8 x 8 digits.

A trace becomes a picture in the same way as in that data set. It is drawn as a thick stroke into a
32 x 32 bitmap, centred, and its longer side fills the bitmap. Then the inked cells of every 4 x 4
block are counted, which gives 8 x 8 numbers from 0 to 16.

Source: Alpaydin and Kaynak, Optical Recognition of Handwritten Digits, UCI repository, 1998.
"""

import warnings
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from spikeport.extras import install_command, missing

if TYPE_CHECKING:
    from sklearn.svm import SVC

BITMAP, BLOCK = 32, 4
PEN = 2.0
"""Half the width of the stroke, in cells of the bitmap; the data set's strokes are about 4 wide."""


def can_read() -> bool:
    """Return whether scikit-learn, which reads digits, is installed."""
    return find_spec("sklearn") is not None


def read_digit(trace: np.ndarray) -> int | None:
    """Return the digit that a trace (n, 2) looks like; None for a trace of a single place.

    The first axis runs right, the second up. None, too, with a warning, if scikit-learn is broken.

    Raises
    ------
    MissingExtraError
        If scikit-learn is absent.
    """
    if not np.ptp(trace, axis=0).any():
        return None
    require()
    try:
        reader = _reader()
    except ImportError as error:
        # Found after a run, which is not to be lost for it.
        line = f"the digit is not read: scikit-learn cannot be imported ({error}); cure: "
        warnings.warn(line + install_command("digits"), stacklevel=2)
        return None
    return int(reader.predict(rasterise(trace).reshape(1, -1))[0])


def rasterise(trace: np.ndarray) -> np.ndarray:
    """Return the picture (8, 8) of a trace (n, 2), from 0 to 16, the top row first."""
    low, high = trace.min(axis=0), trace.max(axis=0)
    # The longer side fills the bitmap, but for half a stroke at each end.
    scale = (BITMAP - 2 * PEN) / (high - low).max()
    cells = np.arange(BITMAP) + 0.5
    across, down = np.meshgrid(cells, cells)
    # The cells of the bitmap in the trace's coordinates in m, rows from top to bottom.
    grid = np.stack([across - BITMAP / 2, BITMAP / 2 - down], axis=-1) / scale + (low + high) / 2
    distance, _ = cKDTree(trace).query(grid)
    inked = distance * scale <= PEN
    counted = inked.reshape(BITMAP // BLOCK, BLOCK, -1, BLOCK).sum(axis=(1, 3))
    return np.asarray(counted, dtype=float)


def require() -> None:
    """Raise `MissingExtraError` if scikit-learn is absent."""
    if not can_read():
        raise missing("reading digits", "scikit-learn", "digits")


@cache
def _reader() -> "SVC":
    from sklearn.datasets import load_digits
    from sklearn.svm import SVC

    digits = load_digits()
    # scikit-learn's own example for this data set has this gamma.
    return SVC(gamma=0.001).fit(digits.data, digits.target)
