"""Sensors at the feet of a simulated robot. Real H1s lack them, and they change no motion.

Each foot gets the positions (m) and velocities (m/s) of its heel and toe, and whether and how it
touches anything (number of contacts, force in N), all in the world frame. Besides the floor, this
is the other foot: its contacts count, since an uneven floor is two bodies, and MuJoCo's sensor can
only match one.
"""

from typing import NamedTuple

import numpy as np

from spikeport.robot.engine import mujoco
from spikeport.robot.feet import FOOT_PARTS, SIDES

SENSORS = {"heel": 3, "toe": 3, "heel velocity": 3, "toe velocity": 3, "contact": 4}
"""Sensors of each foot in their order, and their sizes."""
VALUES = len(SIDES) * sum(SENSORS.values())
"""Number of values of both feet."""
_NET_FORCE = 3


class FootReadings(NamedTuple):
    """Readings of the feet, left foot first, after the leading axes of the values.

    ``points`` (2, 2, 3) are the centres of heel and toe in m, ``velocities`` (2, 2, 3) their
    velocities in m/s, and ``force_n`` (2,) is the magnitude of the force of floor and other
    foot on each foot.
    """

    points: np.ndarray
    velocities: np.ndarray
    force_n: np.ndarray


def readings(values: np.ndarray) -> FootReadings:
    """Return the readings of the feet from the sensors' values (..., `VALUES`)."""
    feet = values.reshape(*values.shape[:-1], len(SIDES), -1)
    n = 3 * len(FOOT_PARTS)
    points, velocities, contact = np.split(feet, (n, 2 * n), axis=-1)
    of_points = (*feet.shape[:-1], len(FOOT_PARTS), 3)
    # A contact sensor has the number of contacts first, then the force.
    force_n = np.linalg.norm(contact[..., 1:], axis=-1)
    return FootReadings(points.reshape(of_points), velocities.reshape(of_points), force_n)


def add_foot_sensors(spec: mujoco.MjSpec) -> None:
    """Add the sensors of both feet after the model's own sensors, left foot first."""
    kind, thing, data = mujoco.mjtSensor, mujoco.mjtObj, mujoco.mjtConDataField
    fields = 1 << int(data.mjCONDATA_FOUND) | 1 << int(data.mjCONDATA_FORCE)
    # Last, as the readers of the model's own sensors count them from the front.
    for foot in SIDES:
        for sensor in (kind.mjSENS_FRAMEPOS, kind.mjSENS_FRAMELINVEL):
            for part in FOOT_PARTS:
                spec.add_sensor(type=sensor, objtype=thing.mjOBJ_GEOM, objname=f"{foot}_{part}")
        spec.add_sensor(
            type=kind.mjSENS_CONTACT,
            objtype=thing.mjOBJ_BODY,
            objname=f"{foot}_ankle_link",
            intprm=[fields, _NET_FORCE, 1],
        )
