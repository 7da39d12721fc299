"""The controller's end: what it waits for, asks again for, skips, and gives up."""

import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.link import over_dds
from spikeport.robot.link.client import Observed
from spikeport.robot.link.codec import decode_command
from spikeport.robot.link.messages import STATES, TRUTHS
from spikeport.robot.link.over_dds import LockStepRobot, RealTimeRobot
from spikeport.robot.link.robot import DAMPING
from tests.helpers.fake_board import FakeClock
from tests.helpers.fake_bus import FakeBus

HOLD = DAMPING


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_dds, "FIRST_S", 0.02)
    monkeypatch.setattr(over_dds, "PATIENCE_S", 0.02)


def lock_step() -> tuple[FakeBus, LockStepRobot, Observed]:
    bus = FakeBus()
    robot = LockStepRobot(bus)
    return bus, robot, robot.first()


def real_time() -> tuple[FakeBus, RealTimeRobot, Observed, FakeClock]:
    bus, clock = FakeBus(), FakeClock()
    robot = RealTimeRobot(bus, True, 0.005, clock)
    return bus, robot, robot.first(), clock


def test_states_come_one_after_the_other_with_the_truth_of_their_tick() -> None:
    _, robot, seen = lock_step()
    for tick in range(10, 60, 5):
        seen = robot.exchange(seen, HOLD)
        assert seen.tick == tick
        assert seen.truth is not None
        assert seen.truth.tick == tick
    assert robot.summary()["states"] == 10
    assert robot.summary()["round_trip_us"]["worst"] > 0


def test_a_command_that_was_lost_is_sent_again() -> None:
    bus, robot, seen = lock_step()
    bus.loses = 2
    assert robot.exchange(seen, HOLD).tick == 10
    answers = [decode_command(message).answers for message in bus.commands.sent]
    assert answers == [5, 5, 5]
    assert bus.robot.robot.steps == 1


def test_damaged_states_are_skipped_and_counted() -> None:
    bus, robot, seen = lock_step()
    bus.readers[STATES].queue.extend([b"nonsense", bytes(1176)])
    bus.readers[TRUTHS].queue.append(b"nonsense")
    assert robot.exchange(seen, HOLD).tick == 10
    assert robot.summary()["damaged"] == 3


def test_a_robot_that_does_not_answer_is_given_up() -> None:
    bus, robot, seen = lock_step()
    bus.publishes = False
    with pytest.raises(RobotLostError, match="does not answer its state of 5 ms"):
        robot.exchange(seen, HOLD)


def test_a_robot_that_left_is_given_up_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_dds, "PATIENCE_S", 1e6)
    bus, robot, seen = lock_step()
    bus.publishes, bus.readers[STATES].writers = False, []
    with pytest.raises(RobotLostError, match="does not answer"):
        robot.exchange(seen, HOLD)


def test_a_robot_that_began_anew_is_given_up() -> None:
    bus, robot, seen = lock_step()
    seen = robot.exchange(robot.exchange(seen, HOLD), HOLD)
    bus.robot.robot.restart()
    with pytest.raises(RobotLostError, match="tick went from 15 back to 5 ms; start the run again"):
        robot.exchange(seen, HOLD)


def test_no_robot_is_said_with_a_cure() -> None:
    bus = FakeBus()
    bus.publishes = False
    with pytest.raises(RobotLostError, match="is `spikeport robot serve` running there"):
        LockStepRobot(bus).first()


def test_leaving_closes_the_bus() -> None:
    bus, robot, _ = lock_step()
    robot.close()
    assert bus.closed


def test_in_real_time_the_newest_state_wins() -> None:
    bus, robot, seen, _ = real_time()
    for _ in range(3):
        bus.publish()
        bus.robot.robot.step()
    bus.publish()
    assert robot.exchange(seen, HOLD).tick == bus.robot.robot.tick
    assert robot.summary()["states"] == 1


def test_in_real_time_nothing_new_is_held_and_then_given_up() -> None:
    _, robot, seen, clock = real_time()
    for held in range(1, 20):
        assert robot.exchange(seen, HOLD) is seen
        assert robot.summary()["held"] == held
    clock.time_s += 0.1
    with pytest.raises(RobotLostError, match=r"no new state for \d+ ms, allowed 100 ms"):
        robot.exchange(seen, HOLD)
    assert robot.summary()["overruns"] == 1


def test_in_real_time_leaving_damps() -> None:
    bus, robot, _, _ = real_time()
    robot.close()
    sent = [decode_command(message).motors for message in bus.commands.sent]
    assert len(sent) == 3
    assert all((motors.kd == 8).all() and not motors.kp.any() for motors in sent)
