"""The robot in real time: started by hand through its controller's states, damped on trouble."""

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.networks.walking_policy import load
from spikeport.pacing import Pace
from spikeport.robot.estimator.registry import EKF
from spikeport.robot.link import controlled
from spikeport.robot.link.codec import STATE, decode_base, decode_command
from spikeport.robot.link.controlled import ControlledRobot, join_by_hand
from spikeport.robot.link.controller import HOLD
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.hoist import Held
from spikeport.robot.link.messages import STATES, TRUTHS
from spikeport.robot.link.motion import EstimatedMotion
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import MotorCommands
from spikeport.robot.walk_interface import observation, targets_rad
from tests.helpers.fake_board import FakeClock
from tests.helpers.fake_bus import HANGS, HERE, FakeBus
from tests.helpers.standing_robot import remote

DT_S = 0.005


class Keys:
    """A terminal whose keys are pressed at chosen calls of `events`."""

    is_heard = True

    def __init__(self, at: dict[int, Event]) -> None:
        self.at, self.calls, self.closed = at, 0, False

    def events(self) -> list[Event]:
        self.calls += 1
        return [self.at[self.calls]] if self.calls in self.at else []

    def close(self) -> None:
        self.closed = True


class LostTerminal(Keys):
    """A terminal that is gone by the time it is closed."""

    def close(self) -> None:
        raise OSError("no terminal")


class LiveBus(FakeBus):
    """A robot that publishes after every command, with the remote's keys pressed at some ticks."""

    def __init__(self, settings: RobotSettings = HANGS, place: Place = HERE) -> None:
        super().__init__(settings, clocked=True, place=place)
        self.pressed: dict[int, tuple[str, ...]] = {}
        self.reboots_after = 0

    def obey(self, message: bytes) -> None:
        super().obey(message)
        if len(self.commands.sent) == self.reboots_after:
            self.robot.restart()
        self.publish()
        queue = self.readers[STATES].queue
        if queue and self.robot.robot.tick in self.pressed:
            state = np.frombuffer(queue[-1], np.uint8).copy()
            begin = STATE.at("wireless_remote")
            keys = remote(*self.pressed[self.robot.robot.tick])
            state[begin : begin + 40] = np.frombuffer(keys, np.uint8)
            queue[-1] = STATE.sealed(state.view("<u4"))


def started(
    at: dict[int, Event], settings: RobotSettings = HANGS
) -> tuple[LiveBus, ControlledRobot, Keys, list[str]]:
    bus, keys, words = LiveBus(settings), Keys(at), []
    pace = Pace(DT_S, FakeClock())
    return bus, ControlledRobot(bus, TRUTHS, pace, keys, words.append), keys, words


def sent(bus: FakeBus) -> list[MotorCommands]:
    return [decode_command(message).motors for message in bus.commands.sent]


BY_TERMINAL = {10: Event.START, 450: Event.RUN}


def test_the_run_begins_by_hand_after_the_ramp() -> None:
    bus, robot, keys, words = started(BY_TERMINAL)
    seen = robot.first()
    assert [line.split(".")[0].removeprefix("robot: ") for line in words] == [
        "zero torque",
        "ramp",
        "hold",
        "run",
    ]
    commands = sent(bus)
    assert len(commands) == 450
    assert not any(values.any() for one in commands[:9] for values in one)
    np.testing.assert_allclose(commands[-1].q, HOLD.q, atol=1e-6)
    driven = HOLD._replace(q=HOLD.q + 0.01)
    robot.exchange(robot.exchange(seen, driven), driven)
    np.testing.assert_allclose(sent(bus)[-1].q, driven.q, atol=1e-6)
    assert robot.summary()["state"] == "run"
    robot.close()
    assert keys.closed
    assert bus.closed
    assert all((one.kd == DAMPING.kd).all() and not one.kp.any() for one in sent(bus)[-3:])


def test_closing_damps_the_robot_even_if_the_terminal_is_gone() -> None:
    bus, keys = LiveBus(), LostTerminal(BY_TERMINAL)
    robot = ControlledRobot(bus, TRUTHS, Pace(DT_S, FakeClock()), keys, lambda _: None)
    robot.first()
    with pytest.raises(OSError, match="no terminal"):
        robot.close()
    assert bus.closed
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_the_terminal_is_closed_if_no_robot_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def none(*_: object) -> None:
        raise RobotLostError("no robot")

    keys = Keys({})
    monkeypatch.setattr(controlled, "own_terminal", lambda: keys)
    monkeypatch.setattr(controlled, "on_bus", none)
    with pytest.raises(RobotLostError, match="no robot"):
        join_by_hand(Place("lo", 7), Pace(DT_S, FakeClock()), None)
    assert keys.closed


@pytest.mark.parametrize(("domain", "told"), [(0, False), (7, True)])
def test_the_truth_is_read_only_in_a_domain_without_real_robots(
    domain: int, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controlled, "own_terminal", lambda: Keys(BY_TERMINAL))
    monkeypatch.setattr(
        controlled, "on_bus", lambda place, _reliable, make: make(LiveBus(place=place))
    )
    monkeypatch.setattr(controlled, "MotionSwitcher", lambda _bus, _required: None)
    robot = join_by_hand(Place("lo", domain), Pace(DT_S, FakeClock()), None)
    assert (robot.first().truth is not None) is told


def test_the_remote_starts_and_stops_the_robot() -> None:
    bus, robot, keys, words = started({})
    keys.is_heard = False
    bus.pressed = {50: ("start",), 2500: ("A",), 2520: ("select",)}
    seen = robot.first()
    assert words[0].startswith("robot: only the remote's keys are read, not a terminal's; cure: ")
    assert words[1].startswith("robot: zero torque. start or s: ")
    assert seen.tick == 2500
    while seen.tick < 2520:
        seen = robot.exchange(seen, HOLD)
    with pytest.raises(RobotLostError, match="go into damping: stop was pressed"):
        robot.exchange(seen, HOLD)
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_a_damaged_state_damps_a_running_robot() -> None:
    bus, robot, _, _ = started(BY_TERMINAL)
    seen = robot.exchange(robot.first(), HOLD)
    bus.readers[STATES].queue.append(bytes(1176))
    with pytest.raises(RobotLostError, match="go into damping: LowState_"):
        robot.exchange(robot.exchange(seen, HOLD), HOLD)
    assert (robot.summary()["state"], robot.summary()["refusals"]) == ("damping", 1)
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_a_command_that_is_not_finite_damps_the_robot() -> None:
    bus, robot, _, _ = started(BY_TERMINAL)
    seen = robot.exchange(robot.first(), HOLD)
    with pytest.raises(RobotLostError, match=r"damping: a command of the policy: q of .* is nan"):
        robot.exchange(seen, HOLD._replace(q=np.full(19, np.nan)))
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_a_stop_before_the_run_ends_when_the_controller_is_armed_again() -> None:
    again = {10: Event.START, 20: Event.STOP, 30: Event.REARM, 40: Event.START, 500: Event.RUN}
    _, robot, _, words = started(again)
    robot.first()
    states = [line.split(".")[0].removeprefix("robot: ") for line in words]
    assert states[:4] == ["zero torque", "ramp", "damping", "zero torque"]
    assert states[-1] == "run"


class Damages(LiveBus):
    """A robot whose state after the fifth command is damaged."""

    def publish(self) -> None:
        super().publish()
        if len(self.commands.sent) == 5:
            self.readers[STATES].queue.append(bytes(1176))


def test_a_stop_does_not_give_an_earlier_refusal_as_its_reason() -> None:
    at = {10: Event.STOP, 20: Event.REARM, 30: Event.START, 500: Event.RUN, 502: Event.STOP}
    bus, words = Damages(), []
    robot = ControlledRobot(bus, TRUTHS, Pace(DT_S, FakeClock()), Keys(at), words.append)
    seen = robot.first()
    assert words[1] == "robot: damping. L1 and R1 or r: begin anew"
    assert robot.summary()["refused"] == "LowState_: its checksum is wrong"
    with pytest.raises(RobotLostError, match="go into damping: stop was pressed"):
        robot.exchange(robot.exchange(seen, HOLD), HOLD)


def test_a_robot_that_restarts_ends_the_run_even_before_it_moves() -> None:
    """The robot may be in sport mode again, which is released only at the start of a run."""
    bus, robot, _, words = started({})
    bus.reboots_after = 300
    with pytest.raises(RobotLostError, match=r"damping: the robot began anew: .* start the run"):
        robot.first()
    assert [line.split(".")[0] for line in words] == ["robot: zero torque"]
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


class Stalls(LiveBus):
    """A robot that sends no state for some time after a chosen command."""

    stalls_at, stalls_for, n_commands = 0, 0, 0

    def publish(self) -> None:
        self.n_commands += 1
        if not self.stalls_at <= self.n_commands < self.stalls_at + self.stalls_for:
            super().publish()


def stalled(at: int, steps: int, keys: dict[int, Event]) -> tuple[Stalls, ControlledRobot, list]:
    bus, words = Stalls(), []
    bus.stalls_at, bus.stalls_for = at, steps
    pace = Pace(DT_S, FakeClock())
    return bus, ControlledRobot(bus, TRUTHS, pace, Keys(keys), words.append), words


def test_a_stall_while_the_robot_hangs_limp_does_not_damp_it() -> None:
    _, robot, words = stalled(5, 100, {200: Event.START, 700: Event.RUN})
    assert robot.first().tick > 0
    assert not any("damping." in line for line in words)
    assert robot.summary()["held"] >= 99


def test_a_stall_in_the_ramp_damps_until_the_robot_is_armed_again() -> None:
    again = {10: Event.START, 200: Event.REARM, 250: Event.START, 800: Event.RUN}
    bus, robot, words = stalled(50, 20, again)
    robot.first()
    assert [line.split(".")[0].removeprefix("robot: ").split(":")[0] for line in words] == [
        *("zero torque", "ramp", "damping", "zero torque", "ramp", "hold", "run")
    ]
    assert "damping: no new state for 4" in words[2]
    damped = [i for i, one in enumerate(sent(bus)) if (one.kd == DAMPING.kd).all()]
    assert 50 <= damped[0] <= 60


def test_a_stall_in_the_run_damps_the_robot_and_ends_the_run() -> None:
    bus, robot, _ = stalled(500, 20, BY_TERMINAL)
    seen = robot.first()

    def go_on(seen: object) -> None:
        for _ in range(100):
            seen = robot.exchange(seen, HOLD)

    with pytest.raises(RobotLostError, match=r"go into damping: no new state for 4\d ms"):
        go_on(seen)
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_a_robot_that_stays_silent_before_the_run_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(controlled, "FIRST_S", 0.3)
    _, robot, _ = stalled(5, 10_000, {})
    with pytest.raises(RobotLostError, match=r"no new state for 30\d ms, allowed 300 ms"):
        robot.first()


@pytest.mark.slow
def test_a_robot_started_by_hand_is_lowered_released_and_walks_on_an_estimate() -> None:
    """Real time with a clock that never stalls: no step of 2,000 is late or held."""
    by_hand = {10: Event.START, 1000: Event.RUN}
    bus, robot, _, _ = started(by_hand, RobotSettings(hoist=True, let_down_s=2.5))
    motion, policy, action = EstimatedMotion(EKF), load(), np.zeros(19)
    seen = robot.first()
    assert (seen.tick, bus.robot.robot.hoist.held) == (5000, Held.STANDS)
    for step in range(1000):
        state = motion(seen)
        if step % 4 == 0:
            action = policy(observation(state, (0.5, 0.0, 0.0), action))
        seen = robot.exchange(seen, HOLD._replace(q=targets_rad(action)))
    assert bus.robot.robot.hoist.held is Held.FREE
    position = decode_base(bus.robot.robot.truth()).position
    assert position[2] > 0.9
    assert np.linalg.norm(position[:2]) > 1.0
    summary = robot.summary()
    assert (summary["state"], summary["refusals"]) == ("run", 0)
    assert (summary["held"], summary["overruns"]) == (0, 0)
