"""Lock-step: a robot steps when the command that answers its state is there, and waits else.

A run is then a function of its seeds, over whatever link. Faults are those of a plan, in the
robot's own time.
"""

from collections.abc import Sequence
from typing import NamedTuple

from spikeport.fault_plan import Fault
from spikeport.robot.link.faults import FaultyWay
from spikeport.robot.link.robot import SimulatedRobot


class Published(NamedTuple):
    """The messages of a robot at one tick: its state, and, in simulation, the truth."""

    state: bytes
    truth: bytes | None


class LockStep:
    """A robot in lock-step with its controller.

    Parameters
    ----------
    robot : SimulatedRobot
        The robot.
    faults : sequence of Fault
        A plan of faults.
    tells_truth : bool
        Whether it publishes place and velocity of its pelvis.

    Attributes
    ----------
    robot : SimulatedRobot
        The robot.
    silent : bool
        Whether a fault made it fall silent.
    """

    def __init__(
        self, robot: SimulatedRobot, faults: Sequence[Fault] = (), tells_truth: bool = True
    ) -> None:
        self.robot = robot
        self._faults, self._tells_truth = faults, tells_truth
        self._begin()

    def _begin(self) -> None:
        self._way = FaultyWay(self.robot.step_ticks, self._faults)
        self._commands = 0
        self.silent = False

    def restart(self) -> None:
        """Begin anew, with the plan of faults, for another controller."""
        self.robot.restart()
        self._begin()

    def published(self) -> Published:
        """Return its present messages."""
        truth = self.robot.truth() if self._tells_truth else None
        return Published(self.robot.state(), truth)

    def answered(self, message: bytes, writer: int) -> bool:
        """Step if a message answers the present state; others leave everything as it is.

        Raises
        ------
        DivergedError
            If the simulation left the numbers it can work with.
        """
        robot = self.robot
        command = robot.read(message, writer)
        if command is None or command.answers != robot.tick or self.silent:
            return False
        self._commands += 1
        self._way.send(self._commands, robot.tick, command)
        self.silent = "stop" in self._way.kinds
        if "restart" in self._way.kinds:
            robot.restart()
            return True
        for one in self._way.arrived(robot.tick):
            robot.obey(one)
        robot.step()
        return True
