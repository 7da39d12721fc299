"""Messages of a robot that stands in its default pose, as a controller has them."""

import struct

import numpy as np

from spikeport.robot.description import DEFAULT_POSE, JOINTS
from spikeport.robot.link.admission import StateMessage, h1_limits
from spikeport.robot.link.remote import KEYS
from spikeport.robot.link.signals import Sensors

N = len(JOINTS)
POSE_RAD = np.array([DEFAULT_POSE[joint] for joint in JOINTS])
LIMITS = h1_limits()._replace(speed_rad_s=np.full(N, 20.0), torque_nm=np.full(N, 200.0))
"""Limits that are alike for all joints, but for the ranges of angles."""
STANDING = Sensors(
    time_s=0.0,
    quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
    gyroscope=np.zeros(3),
    accelerometer=np.array([0.0, 0.0, 9.81]),
    q=POSE_RAD,
    dq=np.zeros(N),
    torque=np.zeros(N),
)


def remote(*keys: str, sticks: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)) -> bytes:
    """Return the 40 bytes of a remote whose keys are down; sticks are left x, y and right x, y."""
    bits = sum(1 << KEYS.index(key) for key in keys)
    left_x, left_y, right_x, right_y = sticks
    return struct.pack("<2xH3f4xf16x", bits, left_x, right_x, right_y, left_y)


def state_message(
    time_s: float, *keys: str, writer: str = "robot", intact: bool = True
) -> StateMessage:
    """Return a message of a standing robot."""
    return StateMessage(STANDING._replace(time_s=time_s), intact, writer, remote(*keys))


def spoilt(good: StateMessage, name: str, value: object) -> StateMessage:
    """Return a message with a value of its sensors replaced, or the first of several."""
    old = getattr(good.sensors, name)
    new = value if np.isscalar(old) else np.concatenate(([value], np.ravel(old)[1:]))
    return good._replace(sensors=good.sensors._replace(**{name: new}))
