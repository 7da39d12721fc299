"""The interface of a walking policy: an observation of 69 numbers, 19 joint targets, at 50 Hz.

    observation = [v, omega, g, command, q - q_default, dq, last action]     (3 3 3 3 19 19 19)
    target = q_default + 0.5 action

Source: the interface of Isaac Lab's ``Isaac-Velocity-Flat-H1``, with the joints in our order.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from spikeport.robot import description
from spikeport.robot.description import JOINTS
from spikeport.robot.state import RobotState

CONTROL_DT_S = 0.02
"""Time from one action to the next."""

ACTION_SCALE_RAD = 0.5
"""Change of a joint's target for an action of one."""

POSE_RAD = description.POSE_RAD
"""Joint angles that the zero action asks for, ``(19,)``."""

PARTS = {
    "linear velocity": slice(0, 3),
    "angular velocity": slice(3, 6),
    "gravity": slice(6, 9),
    "command": slice(9, 12),
    "joint angles": slice(12, 31),
    "joint velocities": slice(31, 50),
    "last action": slice(50, 69),
}
"""Slices of an observation: m/s, rad/s, a unit vector, (vx m/s, vy m/s, wz rad/s),
rad from the default pose, rad/s, and actions; the first three are vectors in the pelvis frame."""

COMMAND_CHANGE_PER_S = np.array([1.0, 1.0, 2.0])
"""The largest change of a command per second: m/s^2, m/s^2 and rad/s^2."""

LOWEST_PELVIS_M = 0.7
SMALLEST_UPRIGHT = float(np.cos(np.pi / 4))
"""A robot has fallen if its pelvis is lower than the first above the ground, or the upward part of
its pelvis' vertical axis is smaller than the second: a tilt of more than 45 degrees."""

OBSERVATION_SIZE = 69
ACTION_SIZE = len(JOINTS)

Number = TypeVar("Number", float, np.ndarray)


def gravity(quaternion: ArrayLike) -> np.ndarray:
    """Return gravity's direction ``(..., 3)`` in the frame of a body turned by (w, x, y, z).

    g = -R^T e_z, the negative last row of the rotation matrix R.
    """
    return np.array(_down(*np.asarray(quaternion, dtype=float).T)).T


def _down(w: Number, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """Return gravity's direction, for numbers or for arrays."""
    return -2 * (x * z - w * y), -2 * (y * z + w * x), -(1 - 2 * (x * x + y * y))


def observation(state: RobotState, command: ArrayLike, last_action: ArrayLike) -> np.ndarray:
    """Return the observation of the policy, ``(69,)``.

    Parameters
    ----------
    state : RobotState
        The motion of the robot.
    command : array_like, (3,)
        Wanted vx, vy (m/s) and wz (rad/s) in the pelvis frame.
    last_action : array_like, (19,)
        The policy's last action; zeros at the start.
    """
    parts = (
        state.base_linear_velocity,
        state.base_angular_velocity,
        _down(*state.base_quaternion.tolist()),  # plain numbers: several times faster than arrays
        command,
        state.q - POSE_RAD,
        state.dq,
        last_action,
    )
    return np.concatenate(parts, dtype=float)


def targets_rad(action: ArrayLike) -> np.ndarray:
    """Return the joint targets of an action, ``(..., 19)``, in rad."""
    return POSE_RAD + ACTION_SCALE_RAD * np.asarray(action, dtype=float)
