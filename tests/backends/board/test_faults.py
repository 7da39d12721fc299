"""The kinds of a board's faults; the reading of plans is in `test_fault_plan`.

The effect of each fault on a run is in `test_chip`.
"""

import pytest

from spikeport.backends.board.faults import FAULTS, KINDS, FaultyLine
from spikeport.backends.board.frame import Frame, Kind, Splitter
from spikeport.errors import UsageError
from tests.helpers.fake_board import FakeClock


class Outlet:
    """The bytes that the host receives: frames, or other bytes."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send_bytes(self, data: bytes) -> None:
        self.sent.append(data)

    @property
    def steps(self) -> list[int]:
        splitter = Splitter()
        splitter.feed(b"".join(self.sent))
        return [frame.step for frame in iter(splitter.next, None)]


def answered(*plan: str, steps: int = 4) -> tuple[Outlet, FakeClock]:
    """Send answers to steps over a line with planned faults."""
    outlet, clock = Outlet(), FakeClock()
    line = FaultyLine(outlet, [FAULTS.parse(text) for text in plan], clock, lambda: None)
    for step in range(1, steps + 1):
        line.send(Frame(Kind.STATE, 7, step, b"body"))
    return outlet, clock


def test_every_kind_of_fault_can_be_planned() -> None:
    for kind in KINDS:
        assert FAULTS.parse("slow=2@1" if kind == "slow" else f"{kind}@1").kind == kind


def test_a_kind_of_fault_of_a_robot_is_refused() -> None:
    with pytest.raises(UsageError, match="--fault 'nan@3': unknown kind of fault 'nan'"):
        FAULTS.parse("nan@3")


def test_all_faults_of_a_step_happen() -> None:
    outlet, clock = answered("slow=5@2", "duplicate@2", "flip@3", "duplicate@3")
    assert clock.now() == pytest.approx(100.005)  # the clock begins at 100 s
    assert outlet.steps == [1, 2, 2, 4]
    assert outlet.sent[3] == outlet.sent[4]  # one bit flipped, then sent twice


@pytest.mark.parametrize("plan", [("loss@2", "wrong-step@2"), ("loss@2", "duplicate@2")])
def test_an_answer_that_is_lost_stays_lost(plan: tuple[str, str]) -> None:
    assert answered(*plan)[0].steps == [1, 3, 4]


def test_consecutive_answers_that_are_put_off_all_arrive() -> None:
    assert answered("reorder@1", "reorder@2")[0].steps == [1, 3, 2, 4]


def test_an_answer_that_is_put_off_twice_still_arrives() -> None:
    assert answered("reorder@2", "reorder@2")[0].steps == [1, 3, 2, 4]


def test_a_step_that_is_requested_again_has_no_faults_again() -> None:
    outlet, clock = Outlet(), FakeClock()
    line = FaultyLine(outlet, [FAULTS.parse("loss:1.0")], clock, lambda: None)
    for _ in range(2):
        line.send(Frame(Kind.STATE, 7, 1, b"body"))
    assert outlet.steps == [1]
