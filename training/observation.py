"""The observations of policy and critic, for a batch of robots."""

from typing import TYPE_CHECKING

import numpy as np

from spikeport.robot import mirror
from spikeport.robot.walk_interface import PARTS, POSE_RAD
from spikeport.training.motion import Motion, turned_back
from spikeport.training.randomisation import observation_noise

if TYPE_CHECKING:
    from spikeport.training.environment import WalkEnvironment

_NOISE = observation_noise()

_MIRRORS = {
    "exact": mirror.OBSERVATION,
    "level velocity": mirror.VECTOR,
    "height of the pelvis": mirror.SCALAR,
    "action delay": mirror.SCALAR,
    "joint offset": mirror.JOINT,
    "contact": mirror.PAIR,
    "force": mirror.PAIR,
    "height of feet": mirror.PAIR,
    "time in the air": mirror.PAIR,
    "time on the floor": mirror.PAIR,
    "time since lifted": mirror.PAIR,
    "smoothed velocity": mirror.Mirror(np.arange(2), np.array([1.0, -1.0])),
    "smoothed yaw rate": mirror.Mirror(np.arange(1), np.array([-1.0])),
    "velocity of feet": mirror.Mirror(np.array([3, 4, 5, 0, 1, 2]), np.tile([1.0, -1.0, 1.0], 2)),
    "observation delay": mirror.SCALAR,
    "error of the velocity": mirror.VECTOR,
    "ground below heels and toes": mirror.Mirror(np.array([2, 3, 0, 1]), np.ones(4)),
}
"""The mirror image of each part of the critic's observations, in their order."""

PRIVILEGED = mirror.joined(*_MIRRORS.values())
"""The mirror image of the critic's observations."""


def exact_observation(env: "WalkEnvironment", motion: Motion) -> np.ndarray:
    """Return the observations of a motion, without noise, ``(n, 69)``."""
    m = motion
    parts = (m.velocity, m.turn_rate, m.gravity, env.commands.value, m.q - POSE_RAD, m.dq)
    return np.concatenate((*parts, env.actions[0]), axis=1)


def noisy(env: "WalkEnvironment", rng: np.random.Generator) -> np.ndarray:
    """Return the policy's observations, ``(n, 69)``: delayed, estimated, and with noise."""
    observed = exact_observation(env, env.observed)
    observed[:, PARTS["linear velocity"]] = env.estimated_velocity
    scale = env.task.randomisation.observation_noise
    return observed + scale * _NOISE * rng.uniform(-1, 1, observed.shape) if scale else observed


def privileged(env: "WalkEnvironment") -> np.ndarray:
    """Return the critic's observations: the exact ones, and values that only a simulation has.

    Smoothed speeds, height of the pelvis, delays, joint offsets, error of the velocity's estimate;
    of the feet: contact, force, height, clocks and velocity in the heading's frame, and the ground
    below heel and toe.
    """
    feet, gait = env.feet, env.gait
    ground_m = feet.ground_m - env.ground_m[:, None, None]
    # Offsets and factors bring each part to a size near one, as the learner's factors do with the
    # policy's observations.
    parts = {
        "exact": exact_observation(env, env.motion),
        "level velocity": env.motion.level_velocity,
        "height of the pelvis": (env.pelvis_m - 0.9)[:, None] * 5,
        "action delay": env.delay[:, None] / 4.0,
        "joint offset": env.joint_offset * 10,
        "contact": feet.contact,
        "force": feet.force_n / 500.0,
        "height of feet": feet.height_m * 10,
        "time in the air": gait.air_s,
        "time on the floor": gait.contact_s.clip(max=1.0),
        "time since lifted": gait.since_lift_s.clip(max=2.0),
        "smoothed velocity": env.velocity,
        "smoothed yaw rate": env.yaw_rate[:, None],
        "velocity of feet": turned_back(feet.velocity, env.motion.heading_rad).reshape(env.n, 6),
        "observation delay": env.observation_delay[:, None] / 4.0,
        "error of the velocity": env.estimated_velocity - env.observed.velocity,
        "ground below heels and toes": ground_m.reshape(env.n, 4) * 10,
    }
    return np.concatenate([parts[name] for name in _MIRRORS], axis=1)
