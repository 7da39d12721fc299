"""Angles in rad."""

import numpy as np
from numpy.typing import ArrayLike


def wrap(angle: ArrayLike) -> np.ndarray:
    """Return angles from -pi to pi: the short way round."""
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi
