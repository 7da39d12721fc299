"""The true motion as an estimate, which only a simulation has."""

from collections.abc import Callable, Sequence

from spikeport.robot.estimator.base import Fix
from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState


class Truth:
    """Estimator that returns the simulated motion, whatever the sensors say.

    Parameters
    ----------
    read : callable
        Reads the motion, such as ``lambda: plant.state``.
    """

    def __init__(self, read: Callable[[], RobotState]) -> None:
        self._read = read

    def reset(self, sensors: Sensors, fix: Fix | None = None) -> RobotState:
        """Return the motion now."""
        return self._read()

    def update(
        self, sensors: Sensors, fix: Fix | None = None, between: Sequence[Sensors] = ()
    ) -> RobotState:
        """Return the motion now."""
        return self._read()

    @property
    def place_deviation_m(self) -> float | None:
        """0: the place is the true one."""
        return 0.0
