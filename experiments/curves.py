"""Curves, as the points that they join."""

import numpy as np


def arc_length(points: np.ndarray) -> np.ndarray:
    """Return the length (n,) of a curve of points (n, d) from its first point to each point."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def interpolated(at: np.ndarray, parameter: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the places (m, d) on a curve where its parameter has the values ``at`` (m,).

    ``parameter`` (n,) has its values at the points (n, d), in increasing order.
    """
    return np.stack([np.interp(at, parameter, column) for column in points.T], axis=1)
