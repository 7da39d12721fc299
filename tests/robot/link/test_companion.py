"""Messages beside the states: the newest one, and waiting for a tick's own on request."""

from collections.abc import Callable

import numpy as np
import pytest

from spikeport.robot.link.codec import Base, encode_base
from spikeport.robot.link.companion import BESIDE_S, SLICE_S, WAITS_S, Companion, Companions
from spikeport.robot.link.messages import ODOMETRY, TRUTHS, Topic
from spikeport.robot.link.odometer import UNTURNED
from tests.helpers.fake_board import FakeClock
from tests.helpers.fake_bus import Arrival, FakeBus, FakeReader


def message(tick: int) -> bytes:
    return encode_base(Base(tick, np.zeros(3), np.zeros(3)))


def asked(answer: Callable[[FakeReader], None]) -> tuple[Companion, FakeReader, FakeClock]:
    """Return a companion, its reader and its clock.

    Whenever the companion waits, `answer` may publish messages, and 4 ms pass.
    """
    clock = FakeClock()

    def ask() -> None:
        clock.time_s += 0.004
        answer(reader)

    reader = FakeReader(ask)
    return Companion(reader, clock), reader, clock


def test_the_newest_message_counts_and_waiting_is_only_on_request() -> None:
    companion, reader, _ = asked(lambda reader: reader.queue.append(message(20)))
    companion.take(20, waits_s=0.0)
    assert (companion.newest, companion.came) == (None, 0)
    reader.queue.extend([message(5), message(10), b"nonsense"])
    companion.take(20, waits_s=0.0)
    assert companion.newest is not None
    assert (companion.newest.tick, companion.came, companion.refused) == (10, 2, 1)
    companion.take(20, waits_s=WAITS_S)
    assert companion.newest.tick == 20
    assert companion.published


def test_a_silent_publisher_is_waited_for_once_and_not_for_long() -> None:
    companion, _, clock = asked(lambda _: None)
    companion.take(5, waits_s=WAITS_S)
    waited_s = clock.time_s - 100
    assert WAITS_S <= waited_s < 2 * WAITS_S
    companion.take(10, waits_s=WAITS_S)
    assert clock.time_s - 100 == waited_s
    assert companion.newest is None


@pytest.mark.parametrize("stamps", [[0] * 9, range(1, 10)], ids=["none", "of another clock"])
def test_a_publisher_whose_stamps_are_behind_is_waited_for_once(stamps: list[int]) -> None:
    """Such a publisher never catches up, so a run would wait at every tick."""
    behind = iter(stamps)
    companion, _, clock = asked(lambda reader: reader.queue.append(message(next(behind))))
    companion.take(20, waits_s=WAITS_S)
    waited_s = clock.time_s - 100
    assert WAITS_S <= waited_s < 2 * WAITS_S
    for tick in (25, 30, 35):
        companion.take(tick, waits_s=WAITS_S)
    assert clock.time_s - 100 == waited_s


def test_a_publisher_that_catches_up_is_waited_for_again() -> None:
    ticks = iter([None, None, None, 15])

    def answer(reader: FakeReader) -> None:
        tick = next(ticks)
        if tick is not None:
            reader.queue.append(message(tick))

    companion, reader, _ = asked(answer)
    companion.take(5, waits_s=WAITS_S)
    reader.queue.append(message(10))
    companion.take(10, waits_s=WAITS_S)
    companion.take(15, waits_s=WAITS_S)
    assert companion.newest is not None
    assert companion.newest.tick == 15


def test_the_first_writer_is_trusted_until_it_is_forgotten() -> None:
    companion, reader, _ = asked(lambda _: None)
    reader.queue.extend([b"nonsense", message(5), Arrival(message(10), 2), message(8)])
    reason = "came from writer 2, earlier ones from writer 1; only one may publish on this topic"
    assert companion.take(5, waits_s=WAITS_S) == reason
    assert companion.newest is not None
    assert (companion.newest.tick, companion.came, companion.refused) == (8, 2, 2)
    assert companion.take(5, waits_s=WAITS_S) is None
    reader.queue.append(message(12))
    companion.forget()
    assert companion.newest is None
    reader.queue.append(Arrival(message(15), 2))
    assert companion.take(15, waits_s=WAITS_S) is None
    assert companion.newest.tick == 15


def odometry(tick: int, x: float, speed: float = 0.0) -> bytes:
    place, velocity = np.array([x, 0.0, 0.0]), np.array([speed, 0.0, 0.0])
    return encode_base(Base(tick, place, velocity))


def test_odometry_of_a_robot_that_moves_as_none_can_is_named() -> None:
    clock = FakeClock()
    reader = FakeReader(lambda: None)
    companion = Companion(reader, clock, measured=True)
    reader.queue.extend([odometry(5, 0.0), odometry(10, 0.6)])
    assert companion.take(10, waits_s=0.0) == "moves the robot by 0.60 m within 0.005 s"
    assert (companion.came, companion.refused) == (1, 1)
    reader.queue.append(odometry(10, 0.0, speed=50.0))
    assert companion.take(10, waits_s=0.0) == "has a robot of 50 m/s, limit 10"
    clock.time_s += 0.02  # in which a robot may move so far
    reader.queue.append(odometry(10, 0.6))
    assert companion.take(10, waits_s=0.0) is None
    reader.queue.append(odometry(0, 9.0))  # a publisher that began anew
    assert companion.take(10, waits_s=0.0) is None
    assert companion.came == 3


def test_the_truth_of_a_simulation_that_began_anew_is_believed() -> None:
    companion, reader, _ = asked(lambda _: None)
    reader.queue.extend([odometry(20_000, 5.0), odometry(0, 0.0)])
    assert companion.take(0, waits_s=0.0) is None
    assert companion.newest is not None
    assert companion.newest.tick == 0


def test_a_run_in_lock_step_waits_long_for_the_motion_that_it_needs_and_in_slices() -> None:
    ticks = iter([*[None] * 40, 5])
    bus = FakeBus()
    beside = Companions(bus, TRUTHS, waits=True)
    companion, reader, clock = asked(
        lambda reader: None if (tick := next(ticks)) is None else reader.queue.append(message(tick))
    )
    waits: list[float] = []
    take = reader.take
    reader.take = lambda within_s=0.0: (waits.append(within_s), take(within_s))[1]  # type: ignore
    beside._of[TRUTHS] = companion
    assert beside.take(5) is None
    assert companion.newest is not None
    assert clock.time_s - 100 > WAITS_S
    assert max(waits) == SLICE_S


def test_an_observation_lacks_the_topic_that_gives_the_motion_until_a_message_comes() -> None:
    bus = FakeBus()
    beside = Companions(bus, ODOMETRY, waits=False)
    assert beside.missing(begins=True).startswith("nobody publishes rt/odommodestate; give --est")
    bus.readers[ODOMETRY].queue.append(message(5))
    beside.take(5)
    assert beside.missing(begins=True) == UNTURNED
    assert beside.missing(begins=False) == ""
    assert Companions(bus, None, waits=False).missing(begins=True) == ""


def test_the_topic_that_gives_the_motion_may_not_be_silent_for_long() -> None:
    bus = FakeBus()
    beside = Companions(bus, ODOMETRY, waits=False)
    beside.watch_from(7.0)
    assert beside.silence(7.0 + BESIDE_S / 2) is None
    bus.readers[ODOMETRY].queue.append(message(5))
    beside.take(5)
    assert beside.silence(8.0) is None
    assert beside.silence(8.3) == "nothing on rt/odommodestate for 300 ms, allowed 200 ms"
    assert Companions(bus, None, waits=False).silence(100.0) is None


@pytest.mark.parametrize(("needs", "refuses"), [(TRUTHS, True), (None, False)])
def test_a_second_publisher_is_refused_on_the_topic_that_gives_the_motion(
    needs: Topic | None, refuses: bool
) -> None:
    bus = FakeBus()
    beside = Companions(bus, needs, waits=False)
    bus.readers[TRUTHS].queue.extend([message(5), Arrival(message(10), 2)])
    reason = beside.take(5)
    assert (reason is not None) is refuses
    assert beside.refused == 1
    newest = beside.newest(TRUTHS)
    assert newest is not None
    assert newest.tick == 5
    beside.forget()
    assert beside.newest(TRUTHS) is None
