"""Pushes: sudden changes of a robot's horizontal velocity."""

import numpy as np

EARLIEST, LATEST = 0.5, 1.5
"""The shortest and longest time between two pushes, as shares of its mean."""


class Pushes:
    """Pushes of one strength in random directions, at random times.

    Parameters
    ----------
    speed_m_s : float
        The change of the velocity; 0 for no pushes.
    every_s : float
        Mean time between pushes.
    rng : numpy.random.RandomState
        Draws times and directions.
    """

    def __init__(self, speed_m_s: float, every_s: float, rng: np.random.RandomState) -> None:
        self._speed_m_s, self._every_s, self._rng = speed_m_s, every_s, rng
        self._next_s = self._later(0.0) if speed_m_s else np.inf

    def due(self, time_s: float) -> np.ndarray | None:
        """Return the velocity change (2,) in the world, m/s, if a push is due, else None."""
        if time_s < self._next_s:
            return None
        # Drawn before the direction: another order of draws would give other runs.
        self._next_s = self._later(time_s)
        direction = self._rng.uniform(-np.pi, np.pi)
        return self._speed_m_s * np.array((np.cos(direction), np.sin(direction)))

    def _later(self, time_s: float) -> float:
        return time_s + self._every_s * self._rng.uniform(EARLIEST, LATEST)
