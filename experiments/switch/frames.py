"""Frames of the arm's places, each as if the robot were anchored and upright.

    local = home + R^T (world - origin)

The arm's controller observes places in the torso's frame. A sheet to draw on is upright, whichever
way the torso leans, and hangs in front of the right shoulder. Once the pen is down, the sheet
follows the mean of the shoulder's place, s' = s + (shoulder - s) dt / tau: the drawing is steady
while the robot sways, and a robot that drifts off is not pulled over by a sheet left behind.
"""

import math
from typing import NamedTuple, Self

import numpy as np

from spikeport.experiments.arm.reach_task import SHOULDER_M
from spikeport.robot.engine import mujoco

FOLLOWING_S = 1.0
"""Time constant tau of a sheet, longer than a stride."""
ANCHORED_PELVIS_M = np.array([0.0, 0.0, 1.06])
_SHOULDER = np.array(SHOULDER_M)


class Frame(NamedTuple):
    """A frame with axes ``rotation`` (3, 3), in which the world's point ``origin`` is at ``home``.

    Places are in m.
    """

    origin: np.ndarray
    rotation: np.ndarray
    home: np.ndarray

    @classmethod
    def of_torso(cls, data: mujoco.MjData, torso: int) -> Self:
        """Return the present frame of the torso, by its number in ``data``."""
        rotation = data.xmat[torso].reshape(3, 3).copy()
        return cls(data.xpos[torso].copy(), rotation, ANCHORED_PELVIS_M)

    def upright(self) -> "Frame":
        """Return the upright frame of this heading with the shoulder in the same place."""
        return _upright(self.rotation[:2, 0], self.world(_SHOULDER), _SHOULDER)

    def following(self, other: "Frame", seconds: float) -> "Frame":
        """Return an upright frame after it has followed another one for a short time."""
        share = seconds / FOLLOWING_S
        ahead = self.rotation[:2, 0]
        # One step of a low-pass filter of direction and origin.
        forward = ahead + share * (other.rotation[:2, 0] - ahead)
        return _upright(forward, self.origin + share * (other.origin - self.origin), self.home)

    def local(self, world: np.ndarray) -> np.ndarray:
        """Return places (..., 3) of the world in this frame."""
        return np.asarray(self.home + (world - self.origin).dot(self.rotation))

    def world(self, local: np.ndarray) -> np.ndarray:
        """Return places (..., 3) of this frame in the world, the inverse of `local`."""
        return np.asarray(self.origin + (local - self.home).dot(self.rotation.T))


def _upright(forward: np.ndarray, origin: np.ndarray, home: np.ndarray) -> Frame:
    """Return the frame whose first axis is a horizontal direction (2,)."""
    c, s = (forward / math.sqrt(forward.dot(forward))).tolist()
    return Frame(origin, np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))), home)
