"""The motion of a batch of robots, for rewards and observations, from MuJoCo's states."""

from dataclasses import dataclass

import numpy as np

from spikeport.arrays import Flags, Floats
from spikeport.robot.walk_interface import gravity
from spikeport.training.model import HEEL_RADIUS_M, TOE_RADIUS_M

CONTACT_FORCE_N = 1.0
"""A foot that presses harder than this is on the floor."""


@dataclass(frozen=True)
class FeetMotion:
    """The feet of n robots, left one first; world frame.

    Attributes
    ----------
    contact : ndarray of bool, (n, 2)
        Whether a foot is on the floor.
    force_n : ndarray, (n, 2)
        Strength of the contact force, N.
    height_m : ndarray, (n, 2)
        Height of the lower of heel and toe above the floor, m.
    velocity : ndarray, (n, 2, 3)
        Velocity of the sole, m/s.
    """

    contact: Flags
    force_n: Floats
    height_m: Floats
    velocity: Floats

    @classmethod
    def from_sensors(cls, sensors: Floats) -> "FeetMotion":
        """The feet, from the sensors ``(n, 26)`` of `training.model`."""
        each = sensors.reshape(len(sensors), 2, -1)
        force = np.linalg.norm(each[..., 10:13], axis=-1)
        height = np.minimum(each[..., 2] - HEEL_RADIUS_M, each[..., 5] - TOE_RADIUS_M)
        return cls(force > CONTACT_FORCE_N, force, height, each[..., 6:9])


@dataclass(frozen=True)
class Motion:
    """The motion of n robots.

    Attributes
    ----------
    height_m : ndarray, (n,)
        Height of the pelvis.
    heading_rad : ndarray, (n,)
        Direction of the pelvis' forward axis about the vertical.
    velocity : ndarray, (n, 3)
        Of the pelvis, in the pelvis frame, m/s.
    level_velocity : ndarray, (n, 3)
        The same, in a frame that only turns about the vertical, m/s.
    turn_rate : ndarray, (n, 3)
        Angular velocity of the pelvis, in the pelvis frame, rad/s.
    yaw_rate : ndarray, (n,)
        Angular velocity about the vertical, rad/s.
    gravity : ndarray, (n, 3)
        Direction of gravity in the pelvis frame.
    q, dq : ndarray, (n, 19)
        Joint angles and velocities, rad and rad/s.
    """

    height_m: Floats
    heading_rad: Floats
    velocity: Floats
    level_velocity: Floats
    turn_rate: Floats
    yaw_rate: Floats
    gravity: Floats
    q: Floats
    dq: Floats

    @classmethod
    def from_states(cls, qpos: Floats, qvel: Floats) -> "Motion":
        """The motion, from MuJoCo's ``qpos (n, 26)`` and ``qvel (n, 25)``."""
        w, x, y, z = qpos[:, 3:7].T
        rotation = _rotation(w, x, y, z)
        heading = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
        down = gravity(qpos[:, 3:7])
        return cls(
            height_m=qpos[:, 2],
            heading_rad=heading,
            velocity=np.einsum("nij,ni->nj", rotation, qvel[:, :3]),
            level_velocity=_turned_back(qvel[:, :3], heading),
            turn_rate=qvel[:, 3:6],
            yaw_rate=-np.einsum("ni,ni->n", down, qvel[:, 3:6]),
            gravity=down,
            q=qpos[:, 7:],
            dq=qvel[:, 6:],
        )


def _rotation(w: Floats, x: Floats, y: Floats, z: Floats) -> Floats:
    """Rotation matrices ``(n, 3, 3)`` of unit quaternions."""
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _turned_back(vectors: Floats, angle: Floats) -> Floats:
    """Vectors ``(n, 3)`` as seen from a frame that is turned about z by ``angle (n,)``."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack((c * x + s * y, c * y - s * x, z), axis=1)
