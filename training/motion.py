"""The motion of a batch of robots, for rewards and observations, from MuJoCo's states."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spikeport.arrays import Flags, Floats
from spikeport.robot.estimator.leg_odometry import DEFAULT as ODOMETRY
from spikeport.robot.foot_sensors import readings
from spikeport.robot.walk_interface import gravity
from spikeport.training.model import HEEL_RADIUS_M, TOE_RADIUS_M

CONTACT_FORCE_N = 1.0
"""A foot that presses harder than this is on the floor."""

_RADII_M = np.array([HEEL_RADIUS_M, TOE_RADIUS_M])
_UP = np.array([0.0, 0.0, 1.0])
HeightOf = Callable[[Floats], Floats]
"""Heights of the ground at points ``(n, k, 2)``."""


@dataclass(frozen=True)
class FeetMotion:
    """The feet of n robots, left one first; world frame.

    Attributes
    ----------
    contact : ndarray of bool, (n, 2)
        True if a foot is on the floor.
    force_n : ndarray, (n, 2)
        Strength of the contact force, N.
    points : ndarray, (n, 2, 2, 3)
        Centres of heel and toe, m.
    point_velocity : ndarray, (n, 2, 2, 3)
        Their velocities, m/s.
    ground_m : ndarray, (n, 2, 2)
        Height of the ground below heel and toe, m.
    """

    contact: Flags
    force_n: Floats
    points: Floats
    point_velocity: Floats
    ground_m: Floats

    @classmethod
    def from_sensors(cls, sensors: Floats, ground: HeightOf) -> "FeetMotion":
        """Return the feet from sensors ``(n, 32)`` of `spikeport.training.model` and the ground."""
        points, velocity, force_n = readings(sensors)
        below = ground(points[..., :2].reshape(-1, 4, 2)).reshape(-1, 2, 2)
        return cls(force_n > CONTACT_FORCE_N, force_n, points, velocity, below)

    @property
    def clearance_m(self) -> Floats:
        """Heights of heel and toe above the ground, ``(n, 2, 2)``, m."""
        # Points are the centres of heel and toe, which are round.
        return np.asarray(self.points[..., 2] - self.ground_m - _RADII_M)

    @property
    def height_m(self) -> Floats:
        """Height of the lower of heel and toe above the ground, ``(n, 2)``, m."""
        return np.asarray(self.clearance_m.min(axis=2))

    @property
    def velocity(self) -> Floats:
        """Velocity of the middle of the sole, ``(n, 2, 3)``, m/s."""
        return np.asarray(self.point_velocity.mean(axis=2))

    @property
    def lowest_velocity(self) -> Floats:
        """Velocity of the lowest points, ``(n, 3)``, m/s, which leg odometry takes to be zero.

        They are a radius below the centres of heel and toe, and turn with the foot: its angular
        velocity follows from both centres, except for turns about the line through them.
        """
        heights = (self.points[..., 2] - _RADII_M).reshape(-1, 4)
        weights = np.exp((heights.min(axis=1, keepdims=True) - heights) / ODOMETRY.lowness_m)
        weights /= weights.sum(axis=1, keepdims=True)
        along = self.points[:, :, 1] - self.points[:, :, 0]
        change = self.point_velocity[:, :, 1] - self.point_velocity[:, :, 0]
        turn = np.cross(along, change) / np.sum(along**2, axis=-1, keepdims=True)
        below = np.cross(turn[:, :, None], -_RADII_M[:, None] * _UP)
        velocity = (self.point_velocity + below).reshape(-1, 4, 3)
        return np.asarray(np.einsum("nk,nki->ni", weights, velocity))


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
        The velocity of the pelvis, in the pelvis frame, m/s.
    level_velocity : ndarray, (n, 3)
        The velocity of the pelvis, in a frame that only turns about the vertical, m/s.
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
        """Return the motion, from MuJoCo's ``qpos (n, 26)`` and ``qvel (n, 25)``."""
        rotation = rotations(qpos[:, 3:7])
        heading = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
        down = gravity(qpos[:, 3:7])
        return cls(
            height_m=qpos[:, 2],
            heading_rad=heading,
            velocity=in_frame(rotation, qvel[:, :3]),
            level_velocity=turned_back(qvel[:, :3], heading),
            turn_rate=qvel[:, 3:6],
            # About the upward vertical, which is opposite to `down`.
            yaw_rate=-np.einsum("ni,ni->n", down, qvel[:, 3:6]),
            gravity=down,
            q=qpos[:, 7:],
            dq=qvel[:, 6:],
        )


def rotations(quaternions: Floats) -> Floats:
    """Return the rotation matrices ``(n, 3, 3)`` of unit quaternions ``(n, 4)``."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def in_frame(rotation: Floats, vectors: Floats) -> Floats:
    """Return vectors ``(n, 3)`` of the world in frames with orientations ``(n, 3, 3)``."""
    return np.asarray(np.einsum("nij,ni->nj", rotation, vectors))


def turned_back(vectors: Floats, angle: Floats) -> Floats:
    """Return vectors ``(n, ..., 3)`` in a frame that is turned about z by ``angle (n,)``."""
    angle = angle.reshape(-1, *(1,) * (vectors.ndim - 2))
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack((c * x + s * y, c * y - s * x, z), axis=-1)
