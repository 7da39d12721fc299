"""The exact law of the path follower, which the spiking network decodes piece by piece.

    e = s_ref - s,  d = |(e_x, e_y)|,  w = |(e_vx, e_vy)|
    v = max(v_min, kp_speed d + kd_speed w)
    wz = kp_heading wrap(atan2(e_y, e_x) - heading)

The target heading is the direction of the point to follow, so the law needs this point to move
ahead of the robot. At speed v, the robot settles at d = v / kp_speed behind it. On a circle of
radius R = v / wz the point then lies at an angle of d / 2R = wz / (2 kp_speed) to the robot's
course. A robot whose course lags its heading by an angle of turn_lag wz has a heading error of
wz (1 / (2 kp_speed) - turn_lag), and stays on the circle if

    1 / kp_heading = 1 / (2 kp_speed) - turn_lag

The default gains are for a turn lag of 0.04 s: the course of a robot that walks by the default
policy lags by up to 0.02 s, and the robot turns later than its command (docs/lab/walk.md). Trained
policies have gains of their own (`spikeport.training.turn_lag`).

Source: paper, sec. 3.2.2. The gains are ours, since the paper gives none. So are the upper limits:
they are those of the commands that the walking policy is trained for.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spikeport.angles import wrap

REFERENCE_SIZE = 4
STATE_SIZE = 5
COMMAND_SIZE = 2


@dataclass(frozen=True)
class FollowerGains:
    """Gains and limits of the law.

    Attributes
    ----------
    kp_speed : float
        Forward speed per distance, in 1/s.
    kd_speed : float
        Forward speed per velocity error.
    kp_heading : float
        Yaw rate per heading error, in 1/s.
    min_speed_m_s, max_speed_m_s : float
        Limits of the forward speed.
    max_yaw_rate_rad_s : float
        Limit of the yaw rate, to both sides.
    """

    kp_speed: float = 1.25
    kd_speed: float = 0.1
    kp_heading: float = 2.8
    min_speed_m_s: float = 0.01
    max_speed_m_s: float = 1.0
    max_yaw_rate_rad_s: float = 1.0

    @property
    def reach_m(self) -> float:
        """The distance at which ``kp_speed`` alone commands the largest speed."""
        return self.max_speed_m_s / self.kp_speed

    def speed(self, distance: ArrayLike, velocity_error: ArrayLike) -> np.ndarray:
        """Return the forward speed in m/s from the lengths of both errors, in m and m/s."""
        wanted = self.kp_speed * np.asarray(distance) + self.kd_speed * np.asarray(velocity_error)
        return _clipped(wanted, self.min_speed_m_s, self.max_speed_m_s)

    def yaw_rate(self, heading_error: ArrayLike) -> np.ndarray:
        """Return the yaw rate in rad/s from the heading error in rad."""
        wanted = self.kp_heading * np.asarray(heading_error)
        return _clipped(wanted, -self.max_yaw_rate_rad_s, self.max_yaw_rate_rad_s)


def gains_for(turn_lag_s: float, kp_speed: float) -> FollowerGains:
    """Return the gains that keep a robot on circles, for its turn lag in s and a speed gain in 1/s.

    The turn lag must be less than 1 / (2 kp_speed): with a larger one, a robot leaves every circle.
    """
    return FollowerGains(kp_speed=kp_speed, kp_heading=1 / (1 / (2 * kp_speed) - turn_lag_s))


def _clipped(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return values within limits; for single numbers, `numpy.clip` takes twice as long."""
    clipped: np.ndarray = np.minimum(np.maximum(values, low), high)
    return clipped


def exact_command(gains: FollowerGains, reference: ArrayLike, state: ArrayLike) -> np.ndarray:
    """Return the forward speed in m/s and yaw rate in rad/s, ``(..., 2)``.

    Parameters
    ----------
    gains : FollowerGains
        Gains and limits.
    reference : array_like, (..., 4)
        Planar position (m) and velocity (m/s) of the point to follow, in the world frame.
    state : array_like, (..., 5)
        Heading (rad), planar position (m) and velocity (m/s) of the robot, in the world frame.
    """
    state = np.asarray(state, dtype=float)
    error = np.asarray(reference, dtype=float) - state[..., 1:]
    x, y, vx, vy = (error[..., i] for i in range(REFERENCE_SIZE))
    command = np.empty((*error.shape[:-1], COMMAND_SIZE))
    command[..., 0] = gains.speed(np.hypot(x, y), np.hypot(vx, vy))
    command[..., 1] = gains.yaw_rate(wrap(np.arctan2(y, x) - state[..., 0]))
    return command
