"""A bus without DDS, with a robot in lock-step at its other end, or none."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from spikeport.robot.link.codec import decode_state, encode_state
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.messages import COMMANDS, ODOMETRY, STATES, TRUTHS, Topic
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings

HANGS, HERE = RobotSettings(hoist=True), Place()


class Arrival(NamedTuple):
    message: bytes
    writer: int


class FakeReader:
    """A reader of messages that are put into its queue; without any, it asks for more."""

    def __init__(self, ask: Callable[[], None]) -> None:
        self.queue: deque[bytes | Arrival] = deque()
        self.writers = [1]
        self._ask = ask

    @property
    def n_writers(self) -> int:
        return len(self.writers)

    def take(self, within_s: float = 0.0) -> list[Arrival]:
        if not self.queue and within_s > 0:
            self._ask()
        found = [one if isinstance(one, Arrival) else Arrival(one, 1) for one in self.queue]
        self.queue.clear()
        return found


class FakeWriter:
    """A writer that keeps its messages."""

    n_readers = 1
    number = 1

    def __init__(self, obey: Callable[[bytes], None]) -> None:
        self.sent: list[bytes] = []
        self._obey = obey

    def write(self, message: bytes) -> None:
        self.sent.append(message)
        self._obey(message)


class FakeBus:
    """A robot on its hoist that obeys what is written, and publishes when somebody waits.

    ``loses`` is the number of next commands that are lost; ``publishes`` is False for a robot that
    fell silent; ``clocked`` is True for a robot whose states ask for no answer.
    """

    def __init__(
        self, settings: RobotSettings = HANGS, clocked: bool = False, place: Place = HERE
    ) -> None:
        self.clocked, self.place = clocked, place
        self.robot = LockStep(SimulatedRobot(settings))
        self.readers = {topic: FakeReader(self.publish) for topic in (STATES, TRUTHS, ODOMETRY)}
        if settings.odometer is None:
            self.readers[ODOMETRY].writers = []
        self.commands = FakeWriter(self.obey)
        self.loses = 0
        self.publishes = True
        self.closed = False

    def reader(self, topic: Topic) -> FakeReader:
        return self.readers[topic]

    def writer(self, topic: Topic) -> FakeWriter:
        assert topic == COMMANDS
        return self.commands

    def obey(self, message: bytes) -> None:
        if self.loses:
            self.loses -= 1
        else:
            self.robot.take_answer(message, writer=1)

    def publish(self) -> None:
        if self.publishes:
            state, truth, odometry = self.robot.published()
            if self.clocked:
                state = encode_state(*decode_state(state))
            self.readers[STATES].queue.append(state)
            if truth is not None:
                self.readers[TRUTHS].queue.append(truth)
            if odometry is not None:
                self.readers[ODOMETRY].queue.append(odometry)

    def close(self) -> None:
        self.closed = True
