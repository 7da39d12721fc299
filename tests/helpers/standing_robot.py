"""Messages of a robot that stands in its default pose, as a controller receives them."""

import struct

import numpy as np

from spikeport.robot.description import DEFAULT_POSE, JOINTS
from spikeport.robot.link.admission import h1_limits
from spikeport.robot.link.remote import KEYS
from spikeport.robot.signals import Sensors

N = len(JOINTS)
POSE_RAD = np.array([DEFAULT_POSE[joint] for joint in JOINTS])
LIMITS = h1_limits()._replace(speed_rad_s=np.full(N, 20.0), torque_nm=np.full(N, 200.0))
"""Limits that are equal for all joints, except for the ranges of angles."""
STANDING = Sensors(
    time_s=0.0,
    quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
    gyroscope=np.zeros(3),
    accelerometer=np.array([0.0, 0.0, 9.81]),
    q=POSE_RAD,
    dq=np.zeros(N),
    torque=np.zeros(N),
)


def remote(*keys: str) -> bytes:
    """Return the 40 bytes of a remote control on which these keys are pressed."""
    bits = sum(1 << KEYS.index(key) for key in keys)
    return struct.pack("<2xH36x", bits)


def spoilt(good: Sensors, name: str, value: object) -> Sensors:
    """Return an observation with the first value of a signal replaced."""
    return good._replace(**{name: np.concatenate(([value], getattr(good, name)[1:]))})
