"""The H1 in Unitree's messages: motor slots, modes, limits, and commands at rest.

Sources: slots and modes, unitree_sdk2 ``example/h1/low_level`` (``motors.hpp``, ``humanoid.hpp``);
limits, unitree_ros ``h1.urdf``.
"""

import numpy as np

from spikeport.robot.description import JOINTS
from spikeport.robot.link.wire import MessageError
from spikeport.robot.plant import DAMPING_KD
from spikeport.robot.signals import MotorCommands

_SLOTS = {
    "right_hip_roll": 0,
    "right_hip_pitch": 1,
    "right_knee": 2,
    "left_hip_roll": 3,
    "left_hip_pitch": 4,
    "left_knee": 5,
    "torso": 6,
    "left_hip_yaw": 7,
    "right_hip_yaw": 8,
    # 9 has no motor
    "left_ankle": 10,
    "right_ankle": 11,
    "right_shoulder_pitch": 12,
    "right_shoulder_roll": 13,
    "right_shoulder_yaw": 14,
    "right_elbow": 15,
    "left_shoulder_pitch": 16,
    "left_shoulder_roll": 17,
    "left_shoulder_yaw": 18,
    "left_elbow": 19,
}
SLOTS = np.array([_SLOTS[joint] for joint in JOINTS])
"""The motor slot of each joint, (19,)."""

MODES = (*(0x0A,) * 10, *(0x01,) * 10)
"""The mode byte of each slot in a command; the weak motors are in slots 10 and up."""

_SPEEDS_RAD_S = {
    **dict.fromkeys(("hip_yaw", "hip_roll", "hip_pitch", "torso"), 23.0),
    "knee": 14.0,
    **dict.fromkeys(("ankle", "shoulder_pitch", "shoulder_roll"), 9.0),
    **dict.fromkeys(("shoulder_yaw", "elbow"), 20.0),
}
_TORQUES_NM = {
    **dict.fromkeys(("hip_yaw", "hip_roll", "hip_pitch", "torso"), 200.0),
    "knee": 300.0,
    **dict.fromkeys(("ankle", "shoulder_pitch", "shoulder_roll"), 40.0),
    **dict.fromkeys(("shoulder_yaw", "elbow"), 18.0),
}


def _of_joints(values: dict[str, float]) -> np.ndarray:
    roles = (joint.removeprefix("left_").removeprefix("right_") for joint in JOINTS)
    return np.array([values[role] for role in roles])


SPEED_LIMITS_RAD_S = _of_joints(_SPEEDS_RAD_S)
"""The speed of each joint beyond which its motor does not accelerate it, (19,)."""
TORQUE_LIMITS_NM = _of_joints(_TORQUES_NM)
"""The largest torque of each joint, (19,)."""
LARGEST_TARGET_RAD = 2 * np.pi
"""The largest target angle of a joint; no joint of the H1 turns that far."""
LARGEST_NUMBER = 1e38
"""The largest number of a command: float32 has no finite numbers above 3.4e38."""
ROUNDING = 1e-6
"""The rounding error of a limit in float32."""

_NONE = np.zeros(len(JOINTS))
ZERO_TORQUE = MotorCommands(_NONE, _NONE, _NONE, _NONE, _NONE)
"""The command that leaves all joints loose."""
DAMPING = ZERO_TORQUE._replace(kd=np.full(len(JOINTS), DAMPING_KD))
"""The command that brakes all joints and holds none."""


def check_commands(commands: MotorCommands) -> None:
    """Refuse commands that motors must not obey.

    Such commands have numbers that are not finite as float32, negative gains, torques beyond a
    motor's limit or, where their gain is above 0, angles beyond `LARGEST_TARGET_RAD` or velocities
    beyond a motor's limit.

    Raises
    ------
    MessageError
        For the first such joint, with value and limit.
    """
    limits = {
        "q": np.where(commands.kp > 0, LARGEST_TARGET_RAD, LARGEST_NUMBER),
        "dq": np.where(commands.kd > 0, SPEED_LIMITS_RAD_S, LARGEST_NUMBER),
        "kp": np.full(len(JOINTS), LARGEST_NUMBER),
        "kd": np.full(len(JOINTS), LARGEST_NUMBER),
        "tau": TORQUE_LIMITS_NM,
    }
    for name, values in commands._asdict().items():
        low = 0.0 if name in ("kp", "kd") else -np.inf
        # No comparison with NaN is true.
        good = (values >= low) & (np.abs(values) <= limits[name] * (1 + ROUNDING))
        if not good.all():
            first = int(np.argmin(good))
            limit = limits[name][first]
            raise MessageError(
                f"{name} of {JOINTS[first]} is {values[first]:g}, "
                f"allowed {max(low, -limit):g} to {limit:g}"
            )
