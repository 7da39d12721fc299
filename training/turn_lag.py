"""The turn lag of a policy, and the gains of a path follower that allow for it.

    lag = (heading - course) . wz / wz . wz
    turn_lag = lag + 0.04 s

A turning robot moves in the direction of its heading a while before: its course lags its heading by
an angle that grows with the yaw rate wz. A follower that uses the heading alone
(`spikeport.networks.path_following`) then leaves curves to their outer side. In these turns, the
shipped policies lag by 0.03 and 0.16 s. A robot also turns later than its command, so 0.04 s are
added: the gains with which either policy stayed closest to the built-in paths are those for 0 to
0.06 s more than its lag on them, 0.02 and 0.15 s (docs/lab/walk.md).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from spikeport.networks.path_following import gains_for
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.training.commands import CommandRange
from spikeport.training.settled import SECONDS, settled

ROBOTS, SEED = 16, 50_000
SPEED_M_S, FASTEST_RAD_S = 0.5, 1.0
SLOWEST_M_S = 0.25
"""The least mean speed of robots that walk."""
LATE_S = 0.04
KP_SPEED = 1.1
"""In 1/s; with a larger gain, a robot that lags is too near its reference to turn with it on the
chip."""
MOST_S = 0.25
"""Largest turn lag that is allowed for: the heading gain is 4.9/s then."""


class Fitted(NamedTuple):
    """A policy, and the turn lag that its gains allow for, in s; None if they were left."""

    policy: WalkingPolicy
    turn_lag_s: float | None


def with_gains(policy: WalkingPolicy) -> Fitted:
    """Return a policy with gains for its turn lag, or the same one if it hardly walks."""
    course, yaw_rate = turning(policy)
    if course[:, 0].mean() < SLOWEST_M_S:
        return Fitted(policy, None)
    # In the frame of the heading, the heading's angle is zero.
    behind = -np.arctan2(course[:, 1], course[:, 0])
    lag_s = float(behind @ yaw_rate / (yaw_rate @ yaw_rate)) + LATE_S
    allowed_s = min(max(lag_s, 0.0), MOST_S)
    return Fitted(replace(policy, gains=gains_for(allowed_s, KP_SPEED)), allowed_s)


def turning(policy: WalkingPolicy) -> tuple[np.ndarray, np.ndarray]:
    """Return mean velocities (16, 2) in m/s ahead and to the left, and yaw rates (16,) in rad/s.

    They are those of undisturbed robots, each of which turns at its own rate.
    """
    turns = CommandRange(
        vx_m_s=(SPEED_M_S, SPEED_M_S),
        wz_rad_s=FASTEST_RAD_S,
        heading=0.0,
        seconds=(SECONDS, SECONDS),
    )
    velocities, rates = [], []
    for motion in settled(policy, turns, ROBOTS, SEED):
        velocities.append(motion.level_velocity[:, :2].copy())
        rates.append(motion.yaw_rate.copy())
    return np.mean(velocities, axis=0), np.mean(rates, axis=0)
