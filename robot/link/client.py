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
from spikeport.robot.link.wire import MessageError
from spikeport.robot.signals import MotorCommands, Sensors


class Observed(NamedTuple):
    """An observation of a robot.

    Attributes
    ----------
    tick : int
        Time of the observation, ms.
    sensors : Sensors
        The values of the robot's sensors.
    truth : Base or None
        Motion of the pelvis, if a simulation publishes it.
    writer : int
        The number of the state's writer.
    remote : bytes
        The message of the wireless remote; empty if it was not requested.
    asks : int
        The tick that the next command answers: in lock-step, the present one.
    came : int
        The value of ``asks`` when the observation came.
    controller : int
        The number of the controller that the robot obeys, in lock-step; 0 for none yet.
    odometry : Base or None
        Motion of the pelvis by an odometer, if one publishes it.
    between : tuple of Sensors
        In real time, the sensors of the states since the last observation, the oldest first: a
        robot publishes more often than a controller observes, and estimators integrate all states.
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
    between: tuple[Sensors, ...] = ()


@dataclass
class ClientFigures:
    """The figures of a link to a robot.

    Attributes
    ----------
    states : int
        New states that the controller answered.
    held : int
        Steps of the controller without a new state.
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
            If no observation comes, or the robot began anew.
        """

    @abstractmethod
    def close(self) -> None:
        """Leave the robot, which then goes into damping."""

    def summary(self) -> dict[str, object]:
        """Return the figures for a run's ``result.json``."""
        return dict(vars(self.figures))


class CommandedRobot(RobotClient):
    """A robot whose client sends the commands itself, and checks the observations."""

    @abstractmethod
    def _send(self, tick: int, motors: MotorCommands) -> None:
        """Send a command to the robot, as the answer to a tick."""

    def _damped(self, tick: int, reason: str) -> RobotLostError:
        """Command damping, and return the error that ends the run, with the reason."""
        self._send(tick, DAMPING)
        return RobotLostError(f"the robot was commanded to go into damping: {reason}")

    def _follow(self, last: Observed, found: Observed) -> Observed:
        """Return the next observation in lock-step: a newer one, or the last one, held.

        Raises
        ------
        RobotLostError
            If the robot began anew, or the last observation was held for too long.
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
    """Return the observation in messages; raises MessageError for invalid ones."""
    tick, sensors = decode_state(messages.state)
    truth, odometry = (
        None if message is None else decode_base(message)
        for message in (messages.truth, messages.odometry)
    )
    asks, controller = turn_of(messages.state)
    now = asks or tick
    return Observed(tick, sensors, truth, writer, remote, now, now, controller, odometry)


def began_anew(before: int, now: int) -> str:
    """Return the reason why a run ends if the robot's tick went back."""
    return (
        f"the robot began anew: its tick went from {before:,} back to {now:,} ms; start the run "
        "again"
    )


class InlineRobot(CommandedRobot):
    """A simulated robot in this process, driven through the same messages.

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
            raise RobotLostError(f"the robot sent no state after that of {last.asks:,} ms")
        messages = self._robot.published()
        try:
            return self._follow(last, observed(messages))
        except MessageError as error:
            self.figures.damaged += 1
            raise self._damped(turn_of(messages.state).asks, str(error)) from None

    def _send(self, tick: int, motors: MotorCommands) -> None:
        self._robot.take_answer(encode_command(Command(tick, motors)), writer=1)

    def close(self) -> None:
        """Leave the robot, and warn of faults of its plan that were never reached."""
        for line in self._robot.never_reached():
            warnings.warn(line, stacklevel=2)

    def summary(self) -> dict[str, object]:
        """Return the figures, with the robot's own summary."""
        return {**super().summary(), "robot": self._robot.robot.summary()}
