"""The robot's motion, as its own sensors would know it."""

from typing import NamedTuple

import numpy as np

from spikeport.robot.engine import mujoco

PELVIS = 1
"""MuJoCo's number of the pelvis, the root of the robot's tree; the world is body 0."""


class RobotState(NamedTuple):
    """The motion of the robot at one moment; every array is a copy.

    Attributes
    ----------
    base_position : ndarray, (3,)
        Origin of the pelvis in the world frame, m.
    base_quaternion : ndarray, (4,)
        Orientation of the pelvis in the world frame, (w, x, y, z).
    base_linear_velocity : ndarray, (3,)
        Velocity of the pelvis' origin, in the pelvis frame, m/s.
    base_angular_velocity : ndarray, (3,)
        Angular velocity of the pelvis, in the pelvis frame, rad/s.
    q, dq : ndarray, (19,)
        Joint angles (rad) and velocities (rad/s) in the order of ``description.JOINTS``.
    """

    base_position: np.ndarray
    base_quaternion: np.ndarray
    base_linear_velocity: np.ndarray
    base_angular_velocity: np.ndarray
    q: np.ndarray
    dq: np.ndarray


def read(data: mujoco.MjData) -> RobotState:
    """Return the state held in data whose kinematics are up to date.

    MuJoCo's free joint keeps the linear velocity in the world frame and the angular velocity in
    the body's: v_base = R^T v_world.
    """
    rotation = data.xmat[PELVIS].reshape(3, 3)
    qpos, qvel = data.qpos.copy(), data.qvel.copy()
    return RobotState(
        base_position=qpos[:3],
        base_quaternion=qpos[3:7],
        base_linear_velocity=rotation.T.dot(qvel[:3]),
        base_angular_velocity=qvel[3:6],
        q=qpos[7:],
        dq=qvel[6:],
    )


def in_plane(state: RobotState) -> np.ndarray:
    """Return heading in rad, place in m and velocity in m/s in the world's plane, (5,)."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, state.base_quaternion)
    velocity = rotation.reshape(3, 3) @ state.base_linear_velocity
    # Row-major: entries (1, 0) and (0, 0), the pelvis' x axis in the plane.
    heading = np.arctan2(rotation[3], rotation[0])
    return np.array((heading, *state.base_position[:2], *velocity[:2]))
