"""The pace of a policy: its forward command is scaled, so that it walks as fast as it is asked to.

    g = v* . v / v* . v*,    W_vx <- W_vx / g

v are the speeds of undisturbed robots, v* the speeds that they are asked for, and W_vx the first
layer's weights of the forward command. A policy that is trained under hard pushes
walks slower than it is asked to, perhaps since slow robots fall less; g was 0.79 to 0.84, over all
speeds together. A policy that has not learned to walk, g below 0.5, is left as it is.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.walk_interface import PARTS
from spikeport.training.commands import CommandRange
from spikeport.training.settled import settled

SPEEDS_M_S = (0.2, 0.4, 0.6, 0.8, 1.0)
ROBOTS, SEED = 8, 40_000
SLOWEST = 0.5
"""The least g of a policy that walks; one that stands or falls may have zero or a negative g."""
FORWARD = PARTS["command"].start


class Paced(NamedTuple):
    """A policy, and the factor 1/g of its forward command; None if it was left as it is."""

    policy: WalkingPolicy
    factor: float | None


def at_asked_speeds(policy: WalkingPolicy) -> Paced:
    """Return a policy whose forward command is divided by g, or the same one if it hardly walks."""
    asked = np.array(SPEEDS_M_S)
    walked = np.array([mean_speed_m_s(policy, speed) for speed in SPEEDS_M_S])
    share = float(asked @ walked / (asked @ asked))
    if share < SLOWEST:
        return Paced(policy, None)
    return Paced(scaled(policy, 1 / share), 1 / share)


def scaled(policy: WalkingPolicy, factor: float) -> WalkingPolicy:
    """Return a policy that acts as if its forward command were ``factor`` times as large."""
    first, *others = policy.weights
    first = first.copy()
    first[:, FORWARD] *= factor
    return replace(policy, weights=(first, *others))


def mean_speed_m_s(policy: WalkingPolicy, asked_m_s: float) -> float:
    """Return the mean speed of undisturbed robots that are asked to walk straight on at a speed."""
    ahead = CommandRange(vx_m_s=(asked_m_s, asked_m_s), wz_rad_s=0.0, heading=0.0)
    motions = settled(policy, ahead, ROBOTS, SEED)
    return float(np.mean([motion.level_velocity[:, 0].mean() for motion in motions]))
