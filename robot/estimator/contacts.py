"""Detection of the sole points that stand on the floor; an H1 has no sensors there.

A point stands if it is about as low as the lowest point, its foot carries weight, and both have
been true for a while: a foot that has just landed still slides and sinks in.
"""

from dataclasses import dataclass

import numpy as np

from spikeport.robot.times import ROUNDING_S


@dataclass(frozen=True)
class ContactLimits:
    """Limits by which a point stands.

    Attributes
    ----------
    height_m : float
        The largest height of a standing point above the lowest point.
    support_n : float
        The smallest force on the foot, as computed from the torques of its leg.
    settling_s : float
        The time for which both must hold.
    """

    height_m: float = 0.01
    support_n: float = 30.0
    settling_s: float = 0.02


class ContactDetector:
    """Detector of contacts by heights and supports, observation by observation."""

    def __init__(self, n_points: int, limits: ContactLimits) -> None:
        self._limits = limits
        self._low_since_s = np.full(n_points, np.inf)

    def update(self, time_s: float, heights_m: np.ndarray, supports_n: np.ndarray) -> np.ndarray:
        """Return which points stand (n,), by their heights and their feet's forces (n,)."""
        limits = self._limits
        low = heights_m - heights_m.min() < limits.height_m
        low &= supports_n > limits.support_n
        self._low_since_s = np.where(low, np.minimum(self._low_since_s, time_s), np.inf)
        # Times are sums of steps: 4 steps of 5 ms may be a rounding error less than 20 ms.
        return np.asarray(time_s - self._low_since_s >= limits.settling_s - ROUNDING_S)
