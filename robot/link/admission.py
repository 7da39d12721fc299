"""Limits of the observations that a controller trusts."""

from typing import NamedTuple

import numpy as np

from spikeport.robot import urdf
from spikeport.robot.description import JOINTS, load
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S, TORQUE_LIMITS_NM
from spikeport.robot.signals import Sensors

LATEST_S = 0.04
"""Age of the last valid observation after which a moving robot is damped. Source: of three robots
with the exact policy and commands as late, one fell, with 50 ms all did (docs/lab/robot.md)."""

PLAUSIBLE_MARGIN_RAD = 0.1
"""The margin of an angle beyond a joint's range, as joint stops yield."""

MARGIN = 2.0
"""The factor over a motor's limits of speed and torque: landing feet turn the knees of a
simulated robot at up to 1.3 times the limit."""

FASTEST_RAD_S, LARGEST_M_S2 = 50.0, 300.0
"""The largest values of an IMU, which measures up to 35 rad/s and 16 g; these do not overflow."""


class Limits(NamedTuple):
    """Limits of plausible observations, each ``(19,)``.

    Attributes
    ----------
    low_rad, high_rad : ndarray
        The bounds of joint angles.
    speed_rad_s, torque_nm : ndarray
        The bounds of the magnitudes of velocities and torques.
    """

    low_rad: np.ndarray
    high_rad: np.ndarray
    speed_rad_s: np.ndarray
    torque_nm: np.ndarray


def h1_limits() -> Limits:
    """Return the limits of an H1: its joints' ranges, and its motors' speeds and torques.

    A range is that of h1.xml, widened to that of Unitree's URDF: a robot folded for transport has
    its hips beyond h1.xml's range. This is a function, not a constant, as it compiles the robot's
    model.
    """
    low, high = load().jnt_range[1:].T.copy()
    for joint, (low_rad, high_rad) in urdf.ranges_rad().items():
        i = JOINTS.index(joint)
        low[i], high[i] = min(low[i], low_rad), max(high[i], high_rad)
    return Limits(
        low - PLAUSIBLE_MARGIN_RAD,
        high + PLAUSIBLE_MARGIN_RAD,
        MARGIN * SPEED_LIMITS_RAD_S,
        MARGIN * TORQUE_LIMITS_NM,
    )


def too_old(age_s: float, most_s: float = LATEST_S) -> str:
    """Return the reason why an observation of this age is no longer trusted."""
    return f"no new state for {1000 * age_s:.0f} ms, allowed {1000 * most_s:.0f} ms"


def beyond(sensors: Sensors, limits: Limits) -> str | None:
    """Return a sentence on the first implausible value of an observation, or None."""
    for name, most, unit in (
        ("gyroscope", FASTEST_RAD_S, "rad/s"),
        ("accelerometer", LARGEST_M_S2, "m/s^2"),
    ):
        largest = float(np.abs(getattr(sensors, name)).max())
        if largest > most:
            return f"{name} is {largest:.3g} {unit}, allowed {most:g}"
    bounds = {
        "q": (limits.low_rad, limits.high_rad, "rad"),
        "dq": (-limits.speed_rad_s, limits.speed_rad_s, "rad/s"),
        "torque": (-limits.torque_nm, limits.torque_nm, "N m"),
    }
    for name, (low, high, unit) in bounds.items():
        values = getattr(sensors, name)
        outside = (values < low) | (values > high)
        if outside.any():
            i = int(np.argmax(outside))
            return (
                f"{name} of {JOINTS[i]} is {values[i]:.3g} {unit}, allowed {low[i]:.3g} to "
                f"{high[i]:.3g}"
            )
    return None
