"""The controller's end of a robot's interface: commands go out, observations come in."""

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from spikeport.errors import RobotLostError
from spikeport.robot.link.admission import LATEST_S, too_old
from spikeport.robot.link.codec import (
    TICK_S,
    Base,
    Command,
    decode_base,
    decode_state,
    encode_command,
    turn_of,
)
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import LockStep, Published
from spikeport.robot.link.signals import MotorCommands, Sensors
from spikeport.robot.link.wire import MessageError


class Observed(NamedTuple):
    """An observation of a robot.

    Attributes
    ----------
    tick : int
        Its moment, ms.
    sensors : Sensors
        The values of the robot's sensors.
    truth : Base or None
        Motion of the pelvis, where a simulation publishes it.
    writer : int
        The writer of the state.
    remote : bytes
        The message of the wireless remote; empty where nobody asked for it.
    asks : int
        The tick that a command answers: in lock-step, that of now.
    came : int
        The tick that it asked to be answered when it came.
    controller : int
        The controller that is obeyed, in lock-step; 0 for nobody yet.
    odometry : Base or None
        Motion of the pelvis by an odometer, where one is published.
    """

    tick: int
    sensors: Sensors
    truth: Base | None
    writer: int = 0
    remote: bytes = b""
    asks: int = 0
    came: int = 0
    controller: int = 0
    odometry: Base | None = None


@dataclass
class ClientFigures:
    """The figures of a link to a robot.

    Attributes
    ----------
    states : int
        States that were controlled by.
    held : int
        Steps of the controller for which there was no new state.
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
    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
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


class CommandedRobot(RobotClient):
    """A robot whose client itself sends the commands, and judges what comes."""

    @abstractmethod
    def _send(self, tick: int, motors: MotorCommands) -> None:
        """Command the robot, as an answer to a tick."""

    def _damped(self, tick: int, reason: str) -> RobotLostError:
        """Command damping, and return the error that ends the run for it."""
        self._send(tick, DAMPING)
        return RobotLostError(f"the robot was commanded to go into damping: {reason}")

    def _follow(self, last: Observed, found: Observed) -> Observed:
        """Return what follows an observation in lock-step: a newer one, or the same, held.

        Raises
        ------
        RobotLostError
            If the robot began anew, or the same one was held for too long.
        """
        if found.asks < last.asks:
            raise RobotLostError(began_anew(last.asks, found.asks))
        if found.tick > last.tick:
            self.figures.states += 1
            return found
        self.figures.held += 1
        held_s = TICK_S * (found.asks - last.came)
        if held_s > LATEST_S:
            raise self._damped(found.asks, too_old(held_s))
        return last._replace(asks=found.asks)


def observed(messages: Published, writer: int = 0, remote: bytes = b"") -> Observed:
    """Return the observation of messages; raises MessageError for what is none."""
    tick, sensors = decode_state(messages.state)
    truth, odometry = (
        None if message is None else decode_base(message)
        for message in (messages.truth, messages.odometry)
    )
    asks, controller = turn_of(messages.state)
    now = asks or tick
    return Observed(tick, sensors, truth, writer, remote, now, now, controller, odometry)


def began_anew(before: int, now: int) -> str:
    """Return why a run ends whose robot is at a tick before an earlier one."""
    return (
        f"the robot began anew: its tick went from {before:,} back to {now:,} ms; start the run "
        "again"
    )


class InlineRobot(CommandedRobot):
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

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and return the next; see `RobotClient.exchange`."""
        self._send(last.asks, motors)
        if self._robot.silent:
            raise RobotLostError(f"the robot does not answer its state of {last.asks:,} ms")
        messages = self._robot.published()
        try:
            return self._follow(last, observed(messages))
        except MessageError as error:
            self.figures.damaged += 1
            raise self._damped(turn_of(messages.state).asks, str(error)) from None

    def _send(self, tick: int, motors: MotorCommands) -> None:
        self._robot.answered(encode_command(Command(tick, motors)), writer=1)

    def close(self) -> None:
        """Leave the robot, and warn of faults of its plan that were never reached."""
        for line in self._robot.never_reached():
            warnings.warn(line, stacklevel=2)

    def summary(self) -> dict[str, object]:
        """Return the figures, with what the robot says of itself."""
        return {**super().summary(), "robot": self._robot.robot.summary()}
