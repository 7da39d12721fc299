"""The feet of the robot that stand on the floor."""

import numpy as np

from spikeport.robot.engine import mujoco

SIDES, PARTS = ("left", "right"), ("heel", "toe")
POINTS = tuple(f"{side}_{part}" for side in SIDES for part in PARTS)
"""Contact shapes of the feet, by their names in h1.xml: a sphere and a capsule across the foot."""


class Feet:
    """The feet of a model.

    Parameters
    ----------
    model : mujoco.MjModel
        The robot on a floor.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        parts = [[model.geom(f"{side}_{part}").id for part in PARTS] for side in SIDES]
        self._foot = {geom: foot for foot, geoms in enumerate(parts) for geom in geoms}
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
