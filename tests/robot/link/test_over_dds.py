"""The controller's end of DDS: waiting, sending again, skipping, damping and giving up."""

import gc
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.errors import BackendError, RobotLostError
from spikeport.pacing import Pace
from spikeport.robot.link import over_dds
from spikeport.robot.link.client import Observed
from spikeport.robot.link.codec import (
    Base,
    Command,
    decode_command,
    encode_base,
    encode_command,
    encode_state,
)
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.messages import ODOMETRY, STATES, TRUTHS, Topic
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.over_dds import LockStepRobot, RealTimeRobot
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import Sensors
from tests.helpers.fake_board import FakeClock
from tests.helpers.fake_bus import Arrival, FakeBus

HOLD = DAMPING
ANOTHER = "another controller drives the robot; only one can at a time"
WITH_ODOMETER = RobotSettings(hoist=True, odometer=OdometerErrors())
READINGS = Sensors(0.0, np.array([1.0, 0, 0, 0]), *np.zeros((2, 3)), *np.zeros((3, 19)))


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_dds, "FIRST_S", 0.3)
    monkeypatch.setattr(over_dds, "PATIENCE_S", 0.3)


def lock_step() -> tuple[FakeBus, LockStepRobot, Observed]:
    bus = FakeBus()
    robot = LockStepRobot(bus, TRUTHS)
    return bus, robot, robot.first()


def real_time(shared: bool = False) -> tuple[FakeBus, RealTimeRobot, Observed, FakeClock]:
    bus, clock = FakeBus(clocked=True), FakeClock()
    robot = RealTimeRobot(bus, TRUTHS, Pace(0.005, clock, shared=shared))
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


@pytest.mark.parametrize("clocked", [False, True])
def test_a_missing_publisher_of_the_truth_is_an_error_only_if_the_truth_is_needed(
    clocked: bool,
) -> None:
    bus = FakeBus(clocked=clocked)
    bus.robot = LockStep(SimulatedRobot(RobotSettings(hoist=True)), tells_truth=False)
    pace = Pace(0.005, FakeClock())
    robot = RealTimeRobot(bus, None, pace) if clocked else LockStepRobot(bus, None)
    seen = robot.first()
    assert seen.truth is None
    bus.publish()
    assert robot.exchange(seen, HOLD).truth is None
    bus.robot.restart()
    other = RealTimeRobot(bus, TRUTHS, pace) if clocked else LockStepRobot(bus, TRUTHS)
    with pytest.raises(RobotLostError, match="nobody publishes rt/sportmodestate"):
        other.first()


def test_damaged_truths_are_skipped_and_counted() -> None:
    bus, robot, seen = lock_step()
    bus.readers[TRUTHS].queue.append(b"nonsense")
    assert robot.exchange(seen, HOLD).tick == 10
    assert robot.summary()["damaged"] == 1


def test_damaged_states_are_skipped_and_counted_until_the_first_command() -> None:
    bus = FakeBus()
    bus.readers[STATES].queue.extend([b"nonsense", bytes(1176)])
    robot = LockStepRobot(bus, TRUTHS)
    assert robot.first().tick == 5
    assert robot.summary()["damaged"] == 2


BETWEEN = {
    "LowState_: 8 bytes, not 1176": b"nonsense",
    "LowState_: its checksum is wrong": bytes(1176),
    "a state came from writer 2, earlier states from writer 1; cure: end one of the two robots, or "
    "give each its own --domain": Arrival(encode_state(5, READINGS), 2),
}


@pytest.mark.parametrize("reason", BETWEEN)
@pytest.mark.parametrize("clocked", [False, True])
def test_a_refused_state_between_two_good_ones_damps_the_robot(clocked: bool, reason: str) -> None:
    bus, robot, seen = real_time()[:3] if clocked else lock_step()
    bus.publish()
    bus.readers[STATES].queue.append(BETWEEN[reason])
    bus.publish()
    with pytest.raises(RobotLostError, match=f"go into damping: {reason}"):
        robot.exchange(seen, HOLD)
    last = decode_command(bus.commands.sent[-1]).motors
    assert (last.kd == 8).all()
    assert not last.kp.any()


def test_states_of_another_controllers_run_are_not_used_to_start_a_run() -> None:
    bus = FakeBus()
    for _ in range(4):
        bus.robot.take_answer(encode_command(Command(bus.robot.robot.tick, HOLD)), writer=7)
    bus.publish()
    bus.robot.restart()  # the other controller has left; its last state is still under way
    seen = (robot := LockStepRobot(bus, TRUTHS)).first()
    assert (seen.tick, seen.controller) == (5, 0)
    assert robot.exchange(seen, HOLD).controller == bus.commands.number


def test_a_robot_that_another_controller_drives_is_not_joined() -> None:
    bus = FakeBus()
    bus.robot.take_answer(encode_command(Command(5, HOLD)), writer=7)
    with pytest.raises(RobotLostError, match=f"^no robot was ready within .*: {ANOTHER}$"):
        LockStepRobot(bus, TRUTHS).first()


def test_a_controller_that_came_second_is_refused() -> None:
    bus, robot, seen = lock_step()
    bus.robot.take_answer(encode_command(Command(5, HOLD)), writer=7)
    with pytest.raises(RobotLostError, match=f"^{ANOTHER}$"):
        robot.exchange(seen, HOLD)


def test_a_slow_robot_is_waited_for() -> None:
    bus, robot, seen = lock_step()
    asked: list[None] = []

    def late() -> None:
        asked.append(None)
        if len(asked) > 2:
            bus.publish()

    bus.readers[STATES]._ask = late
    assert robot.exchange(seen, HOLD).tick == 10
    assert len(asked) > 2


def test_a_robot_that_does_not_answer_is_given_up() -> None:
    bus, robot, seen = lock_step()
    bus.publishes = False
    with pytest.raises(RobotLostError, match="the robot sent no state after that of 5 ms"):
        robot.exchange(seen, HOLD)


def test_a_robot_that_left_is_given_up_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_dds, "PATIENCE_S", 1e6)
    bus, robot, seen = lock_step()
    bus.publishes, bus.readers[STATES].writers = False, []
    with pytest.raises(RobotLostError, match="sent no state after"):
        robot.exchange(seen, HOLD)


def test_a_robot_that_restarted_is_given_up() -> None:
    bus, robot, seen = lock_step()
    seen = robot.exchange(robot.exchange(seen, HOLD), HOLD)
    bus.robot.robot.restart()
    with pytest.raises(RobotLostError, match="tick went from 15 back to 5 ms; start the run again"):
        robot.exchange(seen, HOLD)


def at_5_s() -> tuple[FakeBus, RealTimeRobot, Observed]:
    bus = FakeBus(clocked=True)
    robot = RealTimeRobot(bus, None, Pace(0.005, FakeClock()))
    seen = robot.first()
    bus.readers[STATES].queue.append(encode_state(5000, READINGS))
    return bus, robot, robot.exchange(seen, HOLD)


def test_in_real_time_a_robot_that_restarted_is_damped_and_given_up() -> None:
    bus, robot, seen = at_5_s()
    bus.readers[STATES].queue.append(encode_state(2, READINGS))
    with pytest.raises(RobotLostError, match=r"damping: .* tick went from 5,000 back to 2 ms; "):
        robot.exchange(seen, HOLD._replace(kp=HOLD.kd))
    assert not decode_command(bus.commands.sent[-1]).motors.kp.any()


def test_in_real_time_a_slightly_older_state_is_ignored() -> None:
    bus, robot, seen = at_5_s()
    bus.readers[STATES].queue.append(encode_state(4999, READINGS))
    assert robot.exchange(seen, HOLD) is seen
    assert robot.summary()["held"] == 1


def test_a_missing_robot_is_reported_with_a_cure() -> None:
    bus = FakeBus()
    bus.publishes = False
    with pytest.raises(RobotLostError, match="is `spikeport robot serve` running there"):
        LockStepRobot(bus, TRUTHS).first()


@pytest.mark.slow
def test_a_robot_whose_states_are_refused_is_reported_with_the_reason() -> None:
    """Unitree's simulator in Python sets no checksum."""
    bus = FakeBus()
    bus.publishes = False
    bus.readers[STATES].queue.append(bytes(1176))
    with pytest.raises(
        RobotLostError, match=r"its last state was refused \(LowState_: its checksum"
    ):
        RealTimeRobot(bus, None, Pace(0.005, FakeClock())).first()


def test_a_robot_that_reads_no_commands_is_not_used_to_start_a_run() -> None:
    bus = FakeBus()
    bus.commands.n_readers = 0
    with pytest.raises(RobotLostError, match="it publishes states but does not read commands"):
        LockStepRobot(bus, TRUTHS).first()


def test_in_real_time_a_robot_in_lock_step_is_refused_without_a_command() -> None:
    bus = FakeBus()
    with pytest.raises(RobotLostError, match="waits in lock-step; cure: give --robot-lock-step"):
        RealTimeRobot(bus, TRUTHS, Pace(0.005, FakeClock())).first()
    assert bus.commands.sent == []


def test_in_real_time_a_robot_that_was_just_switched_on_is_used() -> None:
    bus = FakeBus(clocked=True)
    bus.publishes = False
    bus.readers[STATES].queue.append(encode_state(0, READINGS))
    assert RealTimeRobot(bus, None, Pace(0.005, FakeClock())).first().tick == 0


def test_in_lock_step_a_robot_in_real_time_is_refused_without_a_command() -> None:
    bus = FakeBus(clocked=True)
    with pytest.raises(
        RobotLostError,
        match=r"runs in real time and does not wait for answers; .*leave out --robot-lock-step",
    ):
        LockStepRobot(bus, TRUTHS).first()
    assert bus.commands.sent == []


def test_in_real_time_an_observation_beyond_the_limits_damps_the_robot() -> None:
    bus, robot, seen, _ = real_time()
    turned = READINGS._replace(q=np.full(19, 4.0))
    bus.readers[STATES].queue.append(encode_state(10, turned))
    with pytest.raises(RobotLostError, match="damping: q of left_hip_yaw is 4 rad, allowed"):
        robot.exchange(seen, HOLD)
    assert (decode_command(bus.commands.sent[-1]).motors.kd == 8).all()


def test_closing_the_robot_closes_the_bus() -> None:
    bus, robot, _ = lock_step()
    robot.close()
    assert bus.closed


def test_a_bus_is_closed_if_its_robot_cannot_be_made(monkeypatch: pytest.MonkeyPatch) -> None:
    made = FakeBus()
    module = SimpleNamespace(Bus=lambda *_place, **_options: made)
    monkeypatch.setitem(sys.modules, "spikeport.robot.link.bus", module)

    def fail(_bus: FakeBus) -> RealTimeRobot:
        raise BackendError("no topic")

    with pytest.raises(BackendError, match="no topic"):
        over_dds.on_bus(None, True, fail)
    assert made.closed


def test_in_real_time_the_newest_state_wins() -> None:
    bus, robot, seen, _ = real_time()
    for _ in range(3):
        bus.publish()
        bus.robot.take_answer(encode_command(Command(bus.robot.robot.tick, HOLD)), writer=1)
    bus.publish()
    newest = robot.exchange(seen, HOLD)
    assert newest.tick == bus.robot.robot.tick == 20
    assert [round(1000 * sensors.time_s) for sensors in newest.between] == [5, 10, 15]
    assert robot.summary()["states"] == 1


def test_a_step_that_waited_for_a_board_did_not_begin_late_unless_it_missed_a_period() -> None:
    overruns = []
    for shared in (False, True):
        bus, robot, seen, clock = real_time(shared)
        clock.time_s += 0.002  # until the first step of the board's clock
        for late_s in (0.0, 0.0, 0.0, 0.006):
            clock.time_s += 0.005 + late_s
            bus.publish()
            seen = robot.exchange(seen, HOLD)
        overruns.append(robot.summary()["overruns"])
    assert overruns == [4, 1]


def test_in_real_time_the_last_state_is_held_until_a_silent_robot_is_given_up() -> None:
    _, robot, seen, clock = real_time()
    for held in range(1, 8):
        assert robot.exchange(seen, HOLD) is seen
        assert robot.summary()["held"] == held
    clock.time_s += 0.1
    with pytest.raises(RobotLostError, match=r"no new state for \d+ ms, allowed 40 ms"):
        robot.exchange(seen, HOLD)
    assert robot.summary()["overruns"] == 1


def test_odometry_comes_with_the_states_and_its_silence_damps_the_robot() -> None:
    bus, clock = FakeBus(WITH_ODOMETER, clocked=True), FakeClock()
    robot = RealTimeRobot(bus, ODOMETRY, Pace(0.005, clock))
    seen = robot.first()
    assert seen.odometry is not None
    assert seen.odometry.tick == seen.tick
    bus.robot.robot._odometer = None

    def go_on(seen: Observed) -> None:
        for _ in range(100):
            seen = robot.exchange(seen, HOLD)
            bus.publish()

    with pytest.raises(RobotLostError, match=r"nothing on rt/odommodestate for 20\d ms"):
        go_on(seen)
    assert (decode_command(bus.commands.sent[-1]).motors.kd == 8).all()


def test_in_lock_step_odometry_has_the_tick_of_its_state() -> None:
    robot = LockStepRobot(FakeBus(WITH_ODOMETER), ODOMETRY)
    seen = robot.first()
    for _ in range(5):
        seen = robot.exchange(seen, HOLD)
        assert seen.odometry is not None
        assert seen.odometry.tick == seen.tick


def test_in_lock_step_odometry_may_be_silent_for_200_ms_of_the_robots_time() -> None:
    bus = FakeBus(WITH_ODOMETER)
    robot = LockStepRobot(bus, ODOMETRY)
    seen = robot.first()
    odometer, bus.robot.robot._odometer = bus.robot.robot._odometer, None

    def go_on(seen: Observed, n_steps: int) -> Observed:
        for _ in range(n_steps):
            seen = robot.exchange(seen, HOLD)
        return seen

    seen = go_on(seen, 39)
    bus.robot.robot._odometer = odometer
    seen = go_on(seen, 1)
    bus.robot.robot._odometer = None
    seen = go_on(seen, 39)
    reason = r"damping: nothing on rt/odommodestate for 20\d ms, allowed 200 ms$"
    with pytest.raises(RobotLostError, match=reason):
        go_on(seen, 2)
    assert (decode_command(bus.commands.sent[-1]).motors.kd == 8).all()


@pytest.mark.parametrize("clocked", [False, True])
def test_odometry_of_a_second_publisher_damps_the_robot(clocked: bool) -> None:
    """An estimator would jump between the frames of the two publishers."""
    bus, pace = FakeBus(WITH_ODOMETER, clocked=clocked), Pace(0.005, FakeClock())
    robot = RealTimeRobot(bus, ODOMETRY, pace) if clocked else LockStepRobot(bus, ODOMETRY)
    seen = robot.first()
    bus.publish()
    message = bus.readers[ODOMETRY].queue[-1]
    bus.readers[ODOMETRY].queue.append(Arrival(message, 2))
    reason = (
        "damping: a message on rt/odommodestate came from writer 2, earlier ones from writer 1; "
        "only one may publish on this topic$"
    )
    with pytest.raises(RobotLostError, match=reason):
        robot.exchange(seen, HOLD)
    assert (decode_command(bus.commands.sent[-1]).motors.kd == 8).all()
    assert robot.summary()["damaged"] == 1


@pytest.mark.parametrize("needs", [None, TRUTHS])
def test_odometry_that_no_estimator_needs_is_not_read(needs: Topic | None) -> None:
    bus = FakeBus(WITH_ODOMETER)
    robot = LockStepRobot(bus, needs)
    assert robot.exchange(robot.first(), HOLD).odometry is None
    bus.readers[ODOMETRY].queue.append(Arrival(b"nonsense", 2))
    assert robot.summary()["damaged"] == 0


@pytest.mark.parametrize(("domain", "told"), [(0, False), (7, True)])
@pytest.mark.parametrize("clocked", [False, True])
def test_the_truth_is_read_only_in_a_domain_without_real_robots(
    clocked: bool, domain: int, told: bool
) -> None:
    """A real robot's sport mode publishes on the topic of the truth."""
    bus, pace = FakeBus(WITH_ODOMETER, clocked, Place("lo", domain)), Pace(0.005, FakeClock())
    robot = RealTimeRobot(bus, ODOMETRY, pace) if clocked else LockStepRobot(bus, ODOMETRY)
    seen = robot.first()
    assert seen.odometry is not None
    assert (seen.truth is not None) is told
    bus.publish()
    assert (robot.exchange(seen, HOLD).truth is not None) is told


@pytest.mark.slow
def test_odometry_without_an_orientation_is_not_used_to_start_a_run() -> None:
    bus = FakeBus(clocked=True)
    blind = encode_base(Base(2, np.zeros(3), np.zeros(3)))
    bus.readers[ODOMETRY].queue.append(blind)
    robot = RealTimeRobot(bus, ODOMETRY, Pace(0.005, FakeClock()))
    with pytest.raises(
        RobotLostError, match=r"^no robot was ready .*: odometry without an orientation.* cure"
    ):
        robot.first()
    assert bus.commands.sent == []


def test_a_run_goes_on_with_odometry_that_loses_its_orientation() -> None:
    bus = FakeBus(WITH_ODOMETER, clocked=True)
    robot = RealTimeRobot(bus, ODOMETRY, Pace(0.005, FakeClock()))
    seen = robot.first()
    bus.robot.take_answer(encode_command(Command(bus.robot.robot.tick, HOLD)), writer=1)
    bus.publish()
    assert seen.odometry is not None
    turned = Base(10, seen.odometry.position, np.zeros(3))
    bus.readers[ODOMETRY].queue.append(encode_base(turned))
    found = robot.exchange(seen, HOLD)
    assert found.odometry is not None
    assert not found.odometry.has_orientation


class Released:
    """A motion switcher that releases a mode."""

    def release(self) -> list[str]:
        return ["ai"]


@pytest.mark.slow
def test_odometry_of_sport_mode_is_not_used_to_start_a_run() -> None:
    """Sport mode's odometry ends once the mode is released; another publisher has another frame."""
    bus = FakeBus(clocked=True)
    bus.readers[ODOMETRY].queue.append(SimulatedRobot(WITH_ODOMETER).odometry())
    robot = RealTimeRobot(bus, ODOMETRY, Pace(0.005, FakeClock()), Released())
    with pytest.raises(
        RobotLostError, match=r"^no robot was ready .*: nobody publishes rt/odommodestate"
    ):
        robot.first()


def test_in_real_time_closing_damps_the_robot() -> None:
    bus, robot, seen, _ = real_time()
    robot.exchange(seen, HOLD)
    robot.close()
    sent = [decode_command(message).motors for message in bus.commands.sent]
    assert len(sent) == 4
    assert all((motors.kd == 8).all() and not motors.kp.any() for motors in sent[1:])


def test_closing_leaves_a_robot_even_if_damping_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bus, robot, seen, _ = real_time()
    robot.exchange(seen, HOLD)
    assert gc.get_freeze_count() > 0  # existing objects are frozen: garbage collection skips them

    def fail(message: bytes) -> None:
        raise BackendError("DDS cannot write (code -1)")

    monkeypatch.setattr(bus.commands, "write", fail)
    with pytest.raises(BackendError, match="cannot write"):
        robot.close()
    assert bus.closed
    assert gc.get_freeze_count() == 0


class Stuck:
    """A motion switcher that keeps its mode."""

    def release(self) -> list[str]:
        raise BackendError("still in mode 'ai'")


def test_a_robot_that_keeps_its_sport_mode_gets_no_command() -> None:
    bus = FakeBus(clocked=True)
    robot = RealTimeRobot(bus, TRUTHS, Pace(0.005, FakeClock()), Stuck())
    with pytest.raises(BackendError, match="still in mode 'ai'"):
        robot.first()
    robot.close()
    assert bus.commands.sent == []
