"""Observations of a robot by its own sensors, and the commands of its motors."""

from typing import NamedTuple

import numpy as np


class Sensors(NamedTuple):
    """Observation of a robot by its own sensors, at one moment.

    Attributes
    ----------
    time_s : float
        The robot's tick, s.
    quaternion : ndarray, (4,)
        Orientation of the torso's IMU in the world, (w, x, y, z).
    gyroscope : ndarray, (3,)
        Angular velocity in the IMU's frame, rad/s.
    accelerometer : ndarray, (3,)
        Specific force in the IMU's frame, m/s^2.
    q, dq : ndarray, (19,)
        Joint angles (rad) and velocities (rad/s) in the order of ``description.JOINTS``.
    torque : ndarray, (19,)
        Estimated torques of the joints, N m.
    """

    time_s: float
    quaternion: np.ndarray
    gyroscope: np.ndarray
    accelerometer: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    torque: np.ndarray


class MotorCommands(NamedTuple):
    """The command of all joints: torque = tau + kp (q - q_joint) + kd (dq - dq_joint).

    Attributes
    ----------
    q, dq : ndarray, (19,)
        Target angles (rad) and velocities (rad/s) in the order of ``description.JOINTS``.
    kp, kd : ndarray, (19,)
        Gains, N m/rad and N m s/rad.
    tau : ndarray, (19,)
        Torques that are added, N m.
    """

    q: np.ndarray
    dq: np.ndarray
    kp: np.ndarray
    kd: np.ndarray
    tau: np.ndarray
