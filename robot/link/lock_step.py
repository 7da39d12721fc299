"""Lock-step: a robot waits for the command that answers its state, and then steps.

A run then depends only on its seeds, over any link. Faults follow a plan, in the robot's own time.
The robot publishes the newest state that arrived: if a state is late or lost, it publishes the one
before, which still asks for an answer to the present tick.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from spikeport.fault_plan import Fault
from spikeport.robot.link.codec import Command, Turn, encode_state
from spikeport.robot.link.faults import FaultyWay, never_reached, of_commands, of_states
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.signals import Sensors


class Published(NamedTuple):
    """The messages of a robot at one tick: its state, the truth in simulation, its odometry."""

    state: bytes
    truth: bytes | None
    odometry: bytes | None = None


class Outgoing(NamedTuple):
    """An observation of one tick on its way, with the messages of the truth and odometry."""

    tick: int
    sensors: Sensors
    truth: bytes | None
    odometry: bytes | None


class LockStep:
    """A robot in lock-step with its controller.

    Parameters
    ----------
    robot : SimulatedRobot
        The robot.
    faults : sequence of Fault
        A plan of faults.
    tells_truth : bool
        True if the robot publishes place and velocity of its pelvis.

    Attributes
    ----------
    robot : SimulatedRobot
        The robot.
    silent : bool
        True if a fault made the robot fall silent.
    """

    def __init__(
        self, robot: SimulatedRobot, faults: Sequence[Fault] = (), tells_truth: bool = True
    ) -> None:
        self.robot = robot
        self._faults, self._tells_truth = faults, tells_truth
        self._begin()

    def _begin(self) -> None:
        ticks, faults, seed = self.robot.step_ticks, self._faults, self.robot.seed
        self._way = FaultyWay(ticks, _spoilt_command, of_commands(faults), 2 * seed)
        # Another seed, or the same faults would be drawn for both directions.
        self._states = FaultyWay(ticks, _spoilt_state, of_states(faults), 2 * seed + 1)
        self._commands = 0
        self._restarted_for: int | None = None
        self.silent = False
        self._newest = self._outgoing()

    def restart(self) -> None:
        """Restart the robot and the plan of faults, for another controller."""
        self.robot.restart()
        self._begin()

    def is_left(self, writers: list[int]) -> bool:
        """Return whether the controller of this run is no longer among the writers.

        A robot that a fault restarted obeys nobody, but its run lasts until its controller leaves.
        """
        if self._restarted_for is not None and self._restarted_for not in writers:
            return True
        return self.robot.is_left(writers)

    def never_reached(self) -> list[str]:
        """Return a line for each fault of the plan that lies beyond the commands so far."""
        return never_reached(self._faults, self._commands)

    def published(self) -> Published:
        """Return the messages of the newest observation that arrived."""
        newest, turn = self._newest, Turn(self.robot.tick, self.robot.controller)
        state = encode_state(newest.tick, newest.sensors, turn)
        return Published(state, newest.truth, newest.odometry)

    def _outgoing(self) -> Outgoing:
        """Return the robot's present observation; no fault affects the first one."""
        robot = self.robot
        time_s, *arrays = robot.sensors()
        # Copied, as the arrays are the simulation's, and an observation may be delayed by a fault.
        sensors = Sensors(time_s, *(array.copy() for array in arrays))
        truth = robot.truth() if self._tells_truth else None
        return Outgoing(robot.tick, sensors, truth, robot.odometry())

    def take_answer(self, message: bytes, writer: int) -> bool:
        """Step if a message answers the present state; other messages change nothing.

        Raises
        ------
        DivergedError
            If the simulation diverged.
        """
        robot = self.robot
        command = robot.read(message, writer)
        if command is None or command.answers != robot.tick or self.silent:
            return False
        self._commands += 1
        self._way.send(self._commands, robot.tick, command)
        self.silent = "stop" in self._way.kinds
        # A robot at its first tick has nothing to go back from.
        if "restart" in self._way.kinds and robot.steps:
            robot.restart()
            self._restarted_for = writer
            self._newest = self._outgoing()
            return True
        for one in self._way.arrived(robot.tick):
            robot.obey(one)
        robot.step()
        # One more than commands: the first state came before the first command.
        self._states.send(self._commands + 1, robot.tick, self._outgoing())
        # A fault may let an older state arrive after a newer one.
        arrived = (self._newest, *self._states.arrived(robot.tick))
        self._newest = max(arrived, key=lambda one: one.tick)
        return True


def _with_nan(angles: np.ndarray) -> np.ndarray:
    spoilt = angles.copy()
    spoilt[0] = np.nan
    return spoilt


def _spoilt_command(command: Command) -> Command:
    motors = command.motors
    return command._replace(motors=motors._replace(q=_with_nan(motors.q)))


def _spoilt_state(outgoing: Outgoing) -> Outgoing:
    sensors = outgoing.sensors
    return outgoing._replace(sensors=sensors._replace(q=_with_nan(sensors.q)))
