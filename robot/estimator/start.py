"""Where a robot is taken to be when an estimator starts."""

from typing import NamedTuple

import numpy as np

from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import WAIST
from spikeport.robot.link.signals import Sensors


class Start(NamedTuple):
    """A beginning: the torso's rotation (3, 3) and the pelvis' place (3,) in the world."""

    rotation: np.ndarray
    position: np.ndarray


def start(sensors: Sensors, soles: np.ndarray, radii_m: np.ndarray, fix: Fix | None) -> Start:
    """Return the beginning at an observation: the fix, or the IMU's heading above the origin.

    Without a fix the lowest sole is at height 0; ``soles`` (4, 3) are their shapes' centres in the
    pelvis' frame, with ``radii_m`` (4,).
    """
    rotation = torso.rotation(sensors.quaternion)
    pelvis = rotation @ torso.waist_rotation(sensors.q[WAIST]).T
    if fix is None:
        return Start(rotation, np.array([0.0, 0.0, np.max(radii_m - soles @ pelvis[2])]))
    if fix.yaw_rad is not None:
        rotation = torso.turned(rotation, fix.yaw_rad - torso.heading_rad(pelvis))
    return Start(rotation, np.array(fix.position, dtype=float))
