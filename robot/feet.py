"""The feet of the robot that stand on the floor."""

import numpy as np

from spikeport.robot.engine import mujoco

SIDES, PARTS = ("left", "right"), ("heel", "toe")
POINTS = tuple(f"{side}_{part}" for side in SIDES for part in PARTS)
"""Contact shapes of the feet, by their names in h1.xml: a sphere and a capsule across the foot."""


class Feet:
    """The feet of a model, in which the robot's shapes can only touch the floor.

    Parameters
    ----------
    model : mujoco.MjModel
        The robot on a floor.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        parts = [[model.geom(f"{side}_{part}").id for part in PARTS] for side in SIDES]
        self._foot = {geom: foot for foot, geoms in enumerate(parts) for geom in geoms}

    def on_floor(self, data: mujoco.MjData) -> np.ndarray:
        """Return for each foot (2,), the left one first, whether it touches the floor."""
        on_floor = np.zeros(len(SIDES), dtype=bool)
        # Contacts are few, so a loop is faster than calls of NumPy.
        for geom in data.contact.geom.ravel().tolist():
            if geom in self._foot:
                on_floor[self._foot[geom]] = True
        return on_floor
