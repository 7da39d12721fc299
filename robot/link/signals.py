"""What crosses between a robot and its controller, as arrays in the order of our joints."""

from typing import NamedTuple

import numpy as np


class Sensors(NamedTuple):
    """Observation of a robot by its own sensors, from one LowState.

    Attributes
    ----------
    time_s : float
        Tick, s.
    quaternion : ndarray, (4,)
        Torso IMU in the world, (w, x, y, z).
    gyroscope : ndarray, (3,)
        Angular velocity in the IMU's frame, rad/s.
    accelerometer : ndarray, (3,)
        Specific force in the IMU's frame, m/s^2.
    q, dq : ndarray, (19,)
        Joint angles (rad) and velocities (rad/s) in the order of ``robot.description.JOINTS``.
    torque : ndarray, (19,)
        Estimated joint torques, N m.
    """

    time_s: float
    quaternion: np.ndarray
    gyroscope: np.ndarray
    accelerometer: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    torque: np.ndarray


class MotorCommands(NamedTuple):
    """Commands of all joints: torque = tau + kp (q - q_joint) + kd (dq - dq_joint).

    Attributes
    ----------
    q, dq : ndarray, (19,)
        Target angles (rad) and velocities (rad/s).
    kp, kd : ndarray, (19,)
        Gains, N m/rad and N m s/rad.
    tau : ndarray, (19,)
        Torques added, N m.
    """

    q: np.ndarray
    dq: np.ndarray
    kp: np.ndarray
    kd: np.ndarray
    tau: np.ndarray
