"""Reflection of the robot in its sagittal plane: left becomes right.

    P x = sign * x[order],    P P x = x

Pitch, knee, ankle and elbow angles change sides; roll and yaw angles change sides and sign.
"""

from typing import NamedTuple

import numpy as np

from spikeport.arrays import Floats
from spikeport.robot.description import JOINTS


class Mirror(NamedTuple):
    """A signed permutation of the last axis: ``order (n,)``, ``sign (n,)``."""

    order: np.ndarray
    sign: Floats

    def __call__(self, x: Floats) -> Floats:
        """Return the mirror image of ``x (..., n)``."""
        return x[..., self.order] * self.sign


def joined(*mirrors: Mirror) -> Mirror:
    """Return the mirror of concatenated parts."""
    starts = np.cumsum([0, *(len(m.order) for m in mirrors)])
    order = [m.order + start for m, start in zip(mirrors, starts, strict=False)]
    return Mirror(np.concatenate(order), np.concatenate([m.sign for m in mirrors]))


def _other_side(joint: str) -> str:
    side, _, role = joint.partition("_")
    return {"left": f"right_{role}", "right": f"left_{role}"}.get(side, joint)


def _joint_sign(joint: str) -> float:
    # The torso turns about the vertical, as yaw does.
    return -1.0 if joint == "torso" or joint.endswith(("yaw", "roll")) else 1.0


VECTOR = Mirror(np.arange(3), np.array([1.0, -1.0, 1.0]))
"""The mirror of a velocity or direction."""

AXIAL = Mirror(np.arange(3), np.array([-1.0, 1.0, -1.0]))
"""The mirror of an angular velocity."""

COMMAND = Mirror(np.arange(3), np.array([1.0, -1.0, -1.0]))
"""The mirror of (vx, vy, wz)."""

JOINT = Mirror(
    np.array([JOINTS.index(_other_side(j)) for j in JOINTS]),
    np.array([_joint_sign(j) for j in JOINTS]),
)
"""The mirror of joint angles, joint velocities and actions."""

SCALAR = Mirror(np.arange(1), np.ones(1))
PAIR = Mirror(np.array([1, 0]), np.ones(2))
"""The mirror of one number per foot, the left one first."""

OBSERVATION = joined(VECTOR, AXIAL, VECTOR, COMMAND, JOINT, JOINT, JOINT)
