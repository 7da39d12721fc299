"""The H1 in closed loop, with a port that films it."""

from collections.abc import Sequence

import numpy as np

from spikeport.experiments.loop import Loop, Port
from spikeport.robot.plant import Plant


class Film(Port):
    """A port that only watches: it keeps the robot's poses for pictures.

    Parameters
    ----------
    plant : Plant
        The robot.

    Attributes
    ----------
    poses : list of array
        MuJoCo's ``qpos`` at every physics step.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.poses: list[np.ndarray] = []

    def begin(self) -> None:
        """Forget the poses."""
        self.poses = []

    def observe(self) -> np.ndarray:
        """Return no value."""
        return np.empty(0)

    def drive(self, _values: np.ndarray) -> None:
        """Keep the pose."""
        self.poses.append(self.plant.data.qpos.copy())


class Rig:
    """A robot, its ports and the loop that joins them; each experiment adds how a run begins.

    Parameters
    ----------
    plant : Plant
        The robot.
    ports : sequence of Port
        Its ports.
    dt_s : float
        Time step of the controller.
    gate : Port, optional
        A port that opens and closes others, see `Loop`.
    """

    def __init__(
        self, plant: Plant, ports: Sequence[Port], dt_s: float, gate: Port | None = None
    ) -> None:
        self.plant = plant
        self.film = Film(plant)
        self.loop = Loop(plant, [*ports, self.film], dt_s, gate)
