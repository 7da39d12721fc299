"""The pelvis velocity that a robot observes: no sensor measures it, so it is estimated.

    leg odometry    b += s (v - u - b),    s = 1 - exp(-dt / 30 ms)
    other           b = (1 + a) v + w,     w an Ornstein-Uhlenbeck process of 1 s

u is the velocity of the lowest points of the feet, which leg odometry assumes to be at rest
(`spikeport.robot.estimator.leg_odometry`); a and the kind of estimator are drawn for an episode.
An observation that is late has the estimate of its own time.
"""

from dataclasses import dataclass

import numpy as np

from spikeport.arrays import Flags, Floats
from spikeport.robot.estimator.leg_odometry import DEFAULT as ODOMETRY
from spikeport.robot.walk_interface import CONTROL_DT_S

WANDER_S = 1.0


@dataclass(frozen=True)
class EstimatorErrors:
    """The errors of estimated velocities.

    Attributes
    ----------
    odometry : float
        Share of the robots that have leg odometry.
    scale : float
        Largest a of the other robots.
    wander_m_s : float
        Standard deviation of w, along each axis.
    """

    odometry: float = 0.0
    scale: float = 0.0
    wander_m_s: float = 0.0


class VelocityBelief:
    """The estimators of n robots.

    Parameters
    ----------
    n : int
        Number of robots.
    errors : EstimatorErrors
        The estimators' errors.
    rng : Generator
        Draws kinds, scales and wandering.
    """

    def __init__(self, n: int, errors: EstimatorErrors, rng: np.random.Generator) -> None:
        self._errors, self._rng = errors, rng
        self._odometry_m_s, self._odometry_before_m_s, self._wander = np.zeros((3, n, 3))
        self._scale = np.zeros((n, 1))
        self._has_odometry = np.zeros((n, 1), bool)

    def restart(self, which: Flags) -> None:
        """Draw the estimators of some robots, ``which (n,)``, which are at rest."""
        k, errors, rng = int(np.count_nonzero(which)), self._errors, self._rng
        self._has_odometry[which] = rng.random((k, 1)) < errors.odometry
        self._scale[which] = rng.uniform(-errors.scale, errors.scale, (k, 1))
        self._wander[which] = errors.wander_m_s * rng.standard_normal((k, 3))
        self._odometry_m_s[which], self._odometry_before_m_s[which] = 0.0, 0.0

    def update(self, velocity: Floats, slip: Floats) -> None:
        """Advance by one control step, with v and u in the pelvis frame, ``(n, 3)``."""
        share = -np.expm1(-CONTROL_DT_S / ODOMETRY.filter_s)
        self._odometry_before_m_s = self._odometry_m_s
        self._odometry_m_s = (1 - share) * self._odometry_m_s + share * (velocity - slip)
        kept = np.exp(-CONTROL_DT_S / WANDER_S)
        spread = self._errors.wander_m_s * np.sqrt(1 - kept**2)
        self._wander = kept * self._wander + spread * self._rng.standard_normal(velocity.shape)

    def estimate(self, velocity: Floats, age: Floats) -> Floats:
        """Return estimates ``(n, 3)`` of velocities, in m/s.

        Parameters
        ----------
        velocity : ndarray, (n, 3)
            The true velocities in the pelvis frame, in m/s.
        age : ndarray, (n,)
            Age of the velocities as a share of a control step, 0 to 1.
        """
        before, now = self._odometry_before_m_s, self._odometry_m_s
        odometry = now + age[:, None] * (before - now)
        other = (1 + self._scale) * velocity + self._wander
        return np.where(self._has_odometry, odometry, other)
