"""The motion switcher: requests of a controller, and answers of a simulated robot."""

import json
from collections import defaultdict, deque

import pytest

from spikeport.errors import BackendError
from spikeport.robot.link import motion_switcher
from spikeport.robot.link.codec import Command, encode_command
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.messages import SWITCHER_REQUESTS, SWITCHER_RESPONSES, Topic
from spikeport.robot.link.motion_switcher import UNKNOWN_FUNCTION, MotionSwitcher, SwitcherService
from spikeport.robot.link.requests import Response, encode_response
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.sport_mode import CHECK_MODE, EMPTY, Answer
from tests.helpers.fake_bus import Arrival


class End:
    """A reader and writer of a topic in one, which reads the messages that it wrote."""

    def __init__(self, bus: "Exchange") -> None:
        self.queue: deque[bytes] = deque()
        self.bus = bus

    def write(self, message: bytes) -> None:
        self.queue.append(message)

    def take(self, within_s: float = 0.0) -> list[Arrival]:
        if within_s and self.bus.service is not None:
            self.bus.service.serve()
        found = [Arrival(message, 1) for message in self.queue]
        self.queue.clear()
        return found

    @property
    def n_readers(self) -> int:
        return int(self.bus.service is not None)

    @property
    def writers(self) -> list[int]:
        return [1] * self.n_readers


class Exchange:
    """A bus with a robot's motion switcher at its other end, or with none."""

    def __init__(self, robot: SimulatedRobot | None) -> None:
        self.ends: defaultdict[Topic, End] = defaultdict(lambda: End(self))
        self.service = None
        self.service = None if robot is None else SwitcherService(self, robot)

    def reader(self, topic: Topic, *, reliable: bool) -> End:
        assert reliable
        return self.ends[topic]

    def writer(self, topic: Topic) -> End:
        return self.ends[topic]


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("FOUND_S", "ANSWERS_S", "PAUSE_S"):
        monkeypatch.setattr(motion_switcher, name, 0.02)


def in_mode(mode: str) -> SimulatedRobot:
    return SimulatedRobot(RobotSettings(hoist=True, sport_mode=mode))


def test_commands_are_refused_until_the_mode_is_released() -> None:
    robot = in_mode("ai")
    command = encode_command(Command(0, DAMPING))
    assert robot.read(command, writer=1) is None
    assert (robot.refusals.sport_mode, robot.waits) == (1, True)
    assert robot.last_refusal == "the robot is in mode 'ai'; release it first"
    assert MotionSwitcher(Exchange(robot), required=True).release() == ["ai"]
    assert robot.read(command, writer=2) is not None
    robot.restart()
    assert robot.sport_mode == "ai"


def test_a_robot_without_a_mode_is_left_as_it_is() -> None:
    assert MotionSwitcher(Exchange(in_mode("")), required=True).release() == []


def test_a_missing_switcher_is_an_error_only_if_it_is_required() -> None:
    assert MotionSwitcher(Exchange(None), required=False).release() is None
    with pytest.raises(BackendError, match=r"no motion switcher within 0\.02 s"):
        MotionSwitcher(Exchange(None), required=True).release()


def test_a_switcher_that_is_found_late_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, looked = in_mode("ai"), []

    def n_readers(end: End) -> int:
        looked.append(end)
        return int(len(looked) > 5)

    monkeypatch.setattr(motion_switcher, "FOUND_S", 60.0)
    monkeypatch.setattr(motion_switcher.time, "sleep", lambda _seconds: None)
    monkeypatch.setattr(End, "n_readers", property(n_readers))
    assert MotionSwitcher(Exchange(robot), required=True).release() == ["ai"]


@pytest.mark.parametrize(("n_readers", "writers"), [(1, []), (0, [1])])
def test_a_switcher_with_only_a_reader_or_only_a_writer_is_not_asked(
    monkeypatch: pytest.MonkeyPatch, n_readers: int, writers: list[int]
) -> None:
    monkeypatch.setattr(End, "n_readers", n_readers)
    monkeypatch.setattr(End, "writers", writers)
    robot = in_mode("ai")
    with pytest.raises(BackendError, match="no motion switcher"):
        MotionSwitcher(Exchange(robot), required=True).release()
    assert robot.sport_mode == "ai"


def test_answers_to_other_requests_and_damaged_messages_are_ignored() -> None:
    bus = Exchange(in_mode("ai"))
    bus.ends[SWITCHER_RESPONSES].queue.extend(
        [b"nonsense", encode_response(Response(1, CHECK_MODE, 0, '{"name": ""}'))]
    )
    bus.ends[SWITCHER_REQUESTS].queue.append(b"nonsense")
    answer = MotionSwitcher(bus, required=True).ask(CHECK_MODE, EMPTY)
    assert json.loads(answer.data) == {"form": "0", "name": "ai"}


def test_a_switcher_that_is_silent_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Exchange(in_mode("ai"))
    monkeypatch.setattr(bus.service, "serve", lambda: None)
    with pytest.raises(BackendError, match=r"did not answer within 0\.02 s; is the robot up"):
        MotionSwitcher(bus, required=True).release()


def test_an_unknown_function_is_answered_with_unitrees_error_code() -> None:
    switcher = MotionSwitcher(Exchange(in_mode("ai")), required=True)
    assert switcher.ask(1002, '{"name": "ai"}') == Answer(UNKNOWN_FUNCTION, "")


def test_an_answer_is_awaited_in_slices_that_an_interrupt_can_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bus, waits = Exchange(in_mode("ai")), []
    monkeypatch.setattr(motion_switcher, "ANSWERS_S", 10.0)
    taken = End.take
    monkeypatch.setattr(End, "take", lambda end, s=0.0: waits.append(s) or taken(end, s))
    MotionSwitcher(bus, required=True).ask(CHECK_MODE, EMPTY)
    assert waits
    assert max(waits) <= 0.2
