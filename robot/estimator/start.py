"""The pose from which an estimator starts."""

from typing import NamedTuple

import numpy as np

from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import WAIST
from spikeport.robot.signals import Sensors


class Start(NamedTuple):
    """The start of an estimate.

    Attributes
    ----------
    rotation : ndarray, (3, 3)
        The attitude of the torso in the world.
    position : ndarray, (3,)
        The place of the pelvis, m.
    floor_m : float
        Height of the floor, on which the lowest sole stands.
    """

    rotation: np.ndarray
    position: np.ndarray
    floor_m: float


def start(sensors: Sensors, soles: np.ndarray, radii_m: np.ndarray, fix: Fix | None) -> Start:
    """Return the start at an observation: at a fix, or above the origin with the IMU's heading.

    Parameters
    ----------
    sensors : Sensors
        The observation.
    soles : (4, 3) array
        Centres of the soles' shapes in the pelvis' frame, m.
    radii_m : (4,) array
        Radii of these shapes, m.
    fix : Fix or None
        Place and heading; without one, the floor is at height 0.
    """
    rotation = torso.rotation(sensors.quaternion)
    pelvis = torso.pelvis_rotation(rotation, sensors.q[WAIST])
    height_m = float(np.max(radii_m - soles @ pelvis[2]))
    if fix is None:
        return Start(rotation, np.array([0.0, 0.0, height_m]), 0.0)
    if fix.yaw_rad is not None:
        rotation = torso.turned(rotation, fix.yaw_rad - torso.heading_rad(pelvis))
    return Start(rotation, np.array(fix.position, dtype=float), fix.position.item(2) - height_m)
