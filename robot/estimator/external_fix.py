"""The correction of a belief by a place, and a heading, measured from outside."""

from dataclasses import dataclass

import numpy as np

from spikeport.angles import wrap
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.belief import (
    N_ERRORS,
    PLACE,
    ROTATION,
    Belief,
    Observation,
    errors_of,
)
from spikeport.robot.estimator.group import hat
from spikeport.robot.estimator.torso import IMU_OFFSET_M, heading_rad, pelvis_rotation


@dataclass(frozen=True)
class FixNoise:
    """Standard deviations of a fix: its place in m, its heading in rad."""

    position_m: float = 0.01
    yaw_rad: float = 0.02


def displaced(belief: Belief) -> np.ndarray:
    """Return the derivative (3, 27) of the pelvis' place with respect to a correction delta.

    The pelvis is at o = p - R r, and a correction moves it by delta_p + delta_R x o.
    """
    rotation, vectors = belief.pose
    sensitivity = np.zeros((3, N_ERRORS))
    sensitivity[:, ROTATION] = -hat(vectors[PLACE] - rotation @ IMU_OFFSET_M)
    sensitivity[:, errors_of(PLACE)] = np.eye(3)
    return sensitivity


def fixed(belief: Belief, fix: Fix, waist_rad: float, noise: FixNoise) -> Observation:
    """Return the observation that a fix makes.

    A correction delta moves the pelvis as in `displaced`. Its heading, the direction of
    e = R Rz(waist)^T e_x, changes by (e_x (delta_R x e)_y - e_y (delta_R x e)_x) / (e_x^2 + e_y^2).
    """
    rotation, vectors = belief.pose
    pelvis = vectors[PLACE] - rotation @ IMU_OFFSET_M
    sensitivity, innovation = np.zeros((4, N_ERRORS)), np.zeros(4)
    sensitivity[:3] = displaced(belief)
    innovation[:3] = fix.position - pelvis
    size = 3
    if fix.yaw_rad is not None:
        turned = pelvis_rotation(rotation, waist_rad)
        x, y, _ = ahead = turned[:, 0]
        sensitivity[3, ROTATION] = (np.array([-y, x, 0.0]) @ -hat(ahead)) / (x * x + y * y)
        innovation[3] = wrap(fix.yaw_rad - heading_rad(turned))
        size = 4
    deviations = np.array([*3 * (noise.position_m,), noise.yaw_rad])[:size]
    return Observation(innovation[:size], sensitivity[:size], np.diag(deviations**2))
