"""Curves, as the points that they join, how a way is moved along, and sizes of errors."""

import numpy as np

from spikeport.robot.times import PHYSICS_DT_S


def rms(values: np.ndarray, axis: int | None = 0) -> np.ndarray:
    """Return the root mean square over an axis, by default the first; None for all values."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=axis)))


def minimum_jerk(seconds: float, dt_s: float = PHYSICS_DT_S) -> np.ndarray:
    """Return the share of the way at every step, (n,).

    Source: Flash and Hogan, "The coordination of arm movements", 1985.
    """
    tau = np.arange(0.0, seconds, dt_s) / seconds
    # Speed and acceleration are zero at both ends.
    return tau**3 * (10 - 15 * tau + 6 * tau**2)


def arc_length(points: np.ndarray) -> np.ndarray:
    """Return the length (n,) of a curve of points (n, d) from its first point to each point."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def interpolated(at: np.ndarray, parameter: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the places (m, d) on a curve where its parameter has the values ``at`` (m,).

    ``parameter`` (n,) has its values at the points (n, d), in increasing order.
    """
    return np.stack([np.interp(at, parameter, column) for column in points.T], axis=1)
