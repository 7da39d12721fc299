"""The feet of the robot that stand on the floor."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from spikeport.robot.engine import mujoco

SIDES, FOOT_PARTS = ("left", "right"), ("heel", "toe")
POINTS = tuple(f"{side}_{part}" for side in SIDES for part in FOOT_PARTS)
"""Contact shapes of the feet, by their names in h1.xml: a sphere and a capsule across the foot."""


class Sole(NamedTuple):
    """The lowest place of the soles: its height above the floor, and the floor's, both in m."""

    above_m: float
    floor_m: float


class Feet:
    """The feet of a model: all shapes of its ankle links that touch, whatever their names.

    Parameters
    ----------
    model : mujoco.MjModel
        The robot on a floor.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        bodies = [model.body(f"{side}_ankle_link").id for side in SIDES]
        solid = np.isin(model.geom_bodyid, bodies) & (model.geom_conaffinity != 0)
        geoms = np.flatnonzero(solid).tolist()
        self._foot = {geom: bodies.index(model.geom_bodyid[geom]) for geom in geoms}
        # Radius, and half of the length of a capsule, which is 0 for a sphere.
        self._sizes_m = {geom: model.geom_size[geom, :2].tolist() for geom in geoms}
        # Floors have MuJoCo's contype. The robot's shapes lack it, but pairs that the model names,
        # such as both toes, touch each other.
        self._floors = set(np.flatnonzero(model.geom_contype).tolist())

    def on_floor(self, data: mujoco.MjData) -> np.ndarray:
        """Return for each foot (2,), the left one first, whether it touches the floor."""
        on_floor = np.zeros(len(SIDES), dtype=bool)
        # Contacts are few, so a loop is faster than calls of NumPy.
        for one, other in data.contact.geom.tolist():
            if one in self._floors or other in self._floors:
                foot = self._foot.get(one, self._foot.get(other))
                if foot is not None:
                    on_floor[foot] = True
        return on_floor

    def sole(
        self, data: mujoco.MjData, floor_m: Callable[[np.ndarray], float], is_plane: bool
    ) -> Sole:
        """Return the lowest place of the soles above the floor beneath it.

        Shapes are spheres and capsules. ``floor_m`` returns the height of the floor at a place (3,)
        of the world, in m. On a plane the middle of a shape stands for the whole; elsewhere the
        highest floor beneath its middle and its ends counts.
        """
        found, shares = [], (0,) if is_plane else (-1, 0, 1)
        for geom, (radius_m, half_m) in self._sizes_m.items():
            middle, axis = data.geom_xpos[geom], data.geom_xmat[geom, 2::3]
            places = [middle + share * half_m * axis for share in shares]
            beneath_m = max(map(floor_m, places))
            above_m = middle[2] - beneath_m - radius_m - half_m * abs(axis[2])
            found.append(Sole(float(above_m), beneath_m))
        return min(found)
