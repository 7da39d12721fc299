"""The observations of policy and critic, for a batch of robots."""

from typing import TYPE_CHECKING

import numpy as np

from spikeport.robot import mirror
from spikeport.robot.walk_interface import PARTS, POSE_RAD
from spikeport.training.motion import Motion
from spikeport.training.randomisation import observation_noise

if TYPE_CHECKING:
    from spikeport.training.environment import WalkEnvironment

_NOISE = observation_noise()

PRIVILEGED = mirror.joined(
    mirror.OBSERVATION,
    mirror.VECTOR,
    mirror.SCALAR,
    mirror.SCALAR,
    mirror.JOINT,
    *[mirror.PAIR] * 6,
    mirror.Mirror(np.arange(2), np.array([1.0, -1.0])),
    mirror.Mirror(np.arange(1), np.array([-1.0])),
    mirror.Mirror(np.array([3, 4, 5, 0, 1, 2]), np.tile([1.0, -1.0, 1.0], 2)),
    mirror.SCALAR,
    mirror.VECTOR,
    mirror.Mirror(np.array([2, 3, 0, 1]), np.ones(4)),
)
"""Mirror of what `privileged` gives."""


def exact_observation(env: "WalkEnvironment", motion: Motion) -> np.ndarray:
    """Return the observations of a motion, without noise, ``(n, 69)``."""
    m = motion
    parts = (m.velocity, m.turn_rate, m.gravity, env.commands.value, m.q - POSE_RAD, m.dq)
    return np.concatenate((*parts, env.actions[0]), axis=1)


def noisy(env: "WalkEnvironment", rng: np.random.Generator) -> np.ndarray:
    """Return the policy's observations, ``(n, 69)``: late, by an estimator, and with noise."""
    observed = exact_observation(env, env.observed)
    observed[:, PARTS["linear velocity"]] += env.belief.error
    scale = env.task.randomisation.observation_noise
    return observed + scale * _NOISE * rng.uniform(-1, 1, observed.shape) if scale else observed


def privileged(env: "WalkEnvironment") -> np.ndarray:
    """Return the critic's observations: the exact ones, and what only a simulation knows.

    Smoothed speeds, height of the pelvis, delays, joint offsets, error of the velocity's estimate;
    of the feet: contact, force, height, clocks and velocity, and the ground below heel and toe.
    """
    feet, gait = env.feet, env.gait
    parts = (
        exact_observation(env, env.motion),
        env.motion.level_velocity,
        # Offsets and factors bring each part to a size near one, as the learner's do the others.
        (env.pelvis_m - 0.9)[:, None] * 5,
        env.delay[:, None] / 4.0,
        env.joint_offset * 10,
        feet.contact,
        feet.force_n / 500.0,
        feet.height_m * 10,
        gait.air_s,
        gait.contact_s.clip(max=1.0),
        gait.since_lift_s.clip(max=2.0),
        env.velocity,
        env.yaw_rate[:, None],
        feet.velocity.reshape(env.n, 6),
        env.observation_delay[:, None] / 4.0,
        env.belief.error,
        (feet.ground_m - env.ground_m[:, None, None]).reshape(env.n, 4) * 10,
    )
    return np.concatenate(parts, axis=1)
