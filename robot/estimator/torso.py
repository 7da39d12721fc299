"""The torso's IMU and the pelvis, connected by a waist joint about z at the pelvis' origin.

    p_pelvis = p_imu - R_torso r,    R_pelvis = R_torso Rz(waist)^T
    omega_pelvis = Rz(waist) omega_torso - (0, 0, dwaist),    v_pelvis = v_imu - R_torso (omega x r)

Source: joints ``torso_joint`` and ``imu_joint`` of Unitree's h1.urdf, as h1.xml has them;
unitree_rl_gym's ``rotation_helper.py`` for the rotation.
"""

import numpy as np

from spikeport.robot.description import load
from spikeport.robot.engine import mujoco

IMU_OFFSET_M = np.array(load().site("torso_imu").pos)
"""Place r of the IMU in the torso's frame, which has its origin at the pelvis'."""


def rotation_z(angle_rad: float) -> np.ndarray:
    """Return Rz(angle) (3, 3): the rotation about z."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def pelvis_rotation(torso: np.ndarray, waist_rad: float) -> np.ndarray:
    """Return (3, 3) the pelvis' rotation R_torso Rz(waist)^T."""
    return np.asarray(torso @ rotation_z(waist_rad).T)


def pelvis_quaternion(torso: np.ndarray, waist_rad: float) -> np.ndarray:
    """Return the pelvis' orientation (w, x, y, z): q_torso turned back by the waist's angle.

    R_pelvis = R_torso R_z(waist)^T
    """
    w, x, y, z = torso.tolist()
    # A quaternion has half the angle; the sign turns back.
    c, s = float(np.cos(waist_rad / 2)), -float(np.sin(waist_rad / 2))
    return np.array((w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s))


def pelvis_angular_velocity(
    gyroscope: np.ndarray, waist_rad: float, waist_rad_s: float
) -> np.ndarray:
    """Return (3,) the pelvis' angular velocity in its own frame, rad/s."""
    # Plain floats, which are faster than arrays of three numbers.
    x, y, z = gyroscope.tolist()
    c, s = float(np.cos(waist_rad)), float(np.sin(waist_rad))
    return np.array((c * x - s * y, s * x + c * y, z - waist_rad_s))


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return (4,) the quaternion (w, x, y, z) of a rotation (3, 3)."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, rotation.ravel())
    return found


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """Return (3, 3) the rotation of a quaternion (w, x, y, z), of any length but 0."""
    found = np.zeros(9)
    mujoco.mju_quat2Mat(found, quaternion / np.sqrt(quaternion @ quaternion))
    return found.reshape(3, 3)


def heading_rad(rotation: np.ndarray) -> float:
    """Return the direction of a body's x axis about the vertical, rad."""
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def turned(rotation: np.ndarray, angle_rad: float) -> np.ndarray:
    """Return a rotation (3, 3) turned by an angle about the world's vertical."""
    return np.asarray(rotation_z(angle_rad) @ rotation)
