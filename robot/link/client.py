"""The controller's end of a robot's interface: commands go out, observations come in."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from spikeport.errors import RobotLostError
from spikeport.robot.link.codec import Command, Truth, decode_state, decode_truth, encode_command
from spikeport.robot.link.lock_step import LockStep, Published
from spikeport.robot.link.signals import MotorCommands, Sensors


class Observed(NamedTuple):
    """An observation at a tick in ms, with the truth where a simulation tells it."""

    tick: int
    sensors: Sensors
    truth: Truth | None


@dataclass
class ClientFigures:
    """The figures of a link to a robot.

    Attributes
    ----------
    states : int
        States that were controlled by.
    held : int
        Steps of the controller for which there was no new state, in real time.
    damaged : int
        Messages that were refused.
    overruns : int
        Steps of the controller that began late, in real time.
    """

    states: int = 0
    held: int = 0
    damaged: int = 0
    overruns: int = 0


class RobotClient(ABC):
    """A robot to control.

    Attributes
    ----------
    figures : ClientFigures
        The figures of the link.
    """

    def __init__(self) -> None:
        self.figures = ClientFigures()

    @abstractmethod
    def first(self) -> Observed:
        """Return the first observation; raises RobotLostError if none comes."""

    @abstractmethod
    def exchange(self, seen: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation with a command, and return the next observation.

        Raises
        ------
        RobotLostError
            If none comes, or the robot began anew.
        """

    @abstractmethod
    def close(self) -> None:
        """Leave the robot, which then goes into damping."""

    def summary(self) -> dict[str, object]:
        """Return the figures for a run's ``result.json``."""
        return dict(vars(self.figures))


def observed(messages: Published) -> Observed:
    """Return the observation of messages; raises MessageError for what is none."""
    tick, sensors = decode_state(messages.state)
    return Observed(tick, sensors, None if messages.truth is None else decode_truth(messages.truth))


def check_order(seen: Observed, found: Observed) -> None:
    """Raise RobotLostError if a state is of before the one that was seen."""
    if found.tick < seen.tick:
        raise RobotLostError(
            f"the robot began anew: its tick went from {seen.tick:,} back to {found.tick:,} ms; "
            "start the run again"
        )


class InlineRobot(RobotClient):
    """A simulated robot in this process, through the same messages.

    Parameters
    ----------
    robot : LockStep
        The robot.
    """

    def __init__(self, robot: LockStep) -> None:
        super().__init__()
        self._robot = robot

    def first(self) -> Observed:
        """Return the first observation."""
        return observed(self._robot.published())

    def exchange(self, seen: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and return the next; see `RobotClient.exchange`."""
        self._robot.answered(encode_command(Command(seen.tick, motors)), writer=1)
        if self._robot.silent:
            raise RobotLostError(f"the robot does not answer its state of {seen.tick:,} ms")
        found = observed(self._robot.published())
        check_order(seen, found)
        self.figures.states += 1
        return found

    def close(self) -> None:
        """Leave the robot."""

    def summary(self) -> dict[str, object]:
        """Return the figures, with what the robot says of itself."""
        return {**super().summary(), "robot": self._robot.robot.summary()}
