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

from contextlib import closing
from dataclasses import replace

import numpy as np

from spikeport.networks.path_following import gains_for
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.training.commands import CommandRange
from spikeport.training.environment import TrainingTask, WalkEnvironment
from spikeport.training.randomisation import UNDISTURBED

ROBOTS, SEED = 16, 50_000
SPEED_M_S, FASTEST_RAD_S = 0.5, 1.0
SECONDS, SETTLED_S = 10.0, 3.0
"""Duration of a turn, and the time from which the course counts."""
SLOWEST_M_S = 0.25
"""The least mean speed of robots that walk."""
LATE_S = 0.04
KP_SPEED = 1.1
"""In 1/s; with a larger gain, a robot that lags is too near its reference to turn with it on the
chip."""
MOST_S = 0.25
"""Largest turn lag that is allowed for: the heading gain is 4.9/s then."""


def with_gains(policy: WalkingPolicy) -> WalkingPolicy:
    """Return a policy with gains for its turn lag, or the same one if it hardly walks."""
    course, yaw_rate = turning(policy)
    if course[:, 0].mean() < SLOWEST_M_S:
        return policy
    # In the frame of the heading, the heading's angle is zero.
    behind = -np.arctan2(course[:, 1], course[:, 0])
    lag_s = float(behind @ yaw_rate / (yaw_rate @ yaw_rate)) + LATE_S
    return replace(policy, gains=gains_for(min(max(lag_s, 0.0), MOST_S), KP_SPEED))


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
    with closing(WalkEnvironment(ROBOTS, TrainingTask(turns, UNDISTURBED), SEED)) as env:
        for _ in range(round(SECONDS / CONTROL_DT_S)):
            env.step(policy(env.observe()))
            velocities.append(env.motion.level_velocity[:, :2].copy())
            rates.append(env.motion.yaw_rate.copy())
    settled = slice(round(SETTLED_S / CONTROL_DT_S), None)
    return np.mean(velocities[settled], axis=0), np.mean(rates[settled], axis=0)
