"""The feet of the robot that stand on the floor."""

import numpy as np

from spikeport.robot.engine import mujoco

SIDES = ("left", "right")
_FEET = range(len(SIDES))
_PARTS = ("heel", "toe")


class Feet:
    """The feet of a model; shapes that touch anything touch the floor, as the model is made.

    Parameters
    ----------
    model : mujoco.MjModel
        The robot on a floor.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        parts = [[model.geom(f"{side}_{part}").id for part in _PARTS] for side in SIDES]
        # The number behind the last foot stands for every other shape.
        self._foot = np.full(model.ngeom, len(SIDES))
        for foot, geoms in enumerate(parts):
            self._foot[geoms] = foot

    def on_floor(self, data: mujoco.MjData) -> np.ndarray:
        """Return for each foot (2,), the left one first, whether it touches the floor."""
        touching = self._foot[data.contact.geom].ravel().tolist()
        return np.array([foot in touching for foot in _FEET])
