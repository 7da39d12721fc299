"""A robot in real time is led through its controller's states, and damped when it leaves them."""

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.link import over_dds
from spikeport.robot.link.codec import STATE, decode_command
from spikeport.robot.link.controlled import ControlledRobot
from spikeport.robot.link.controller import HOLD
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.messages import STATES, TRUTHS
from spikeport.robot.link.signals import MotorCommands
from tests.helpers.arrivals import remote
from tests.helpers.fake_board import FakeClock
from tests.helpers.fake_bus import FakeBus

DT_S = 0.005


class Keys:
    """A terminal whose keys are pressed at calls that were chosen."""

    def __init__(self, at: dict[int, Event]) -> None:
        self.at, self.calls, self.closed = at, 0, False

    def events(self) -> list[Event]:
        self.calls += 1
        return [self.at[self.calls]] if self.calls in self.at else []

    def close(self) -> None:
        self.closed = True


class LiveBus(FakeBus):
    """A robot that publishes after every command, with the remote's keys at ticks."""

    def __init__(self) -> None:
        super().__init__()
        self.pressed: dict[int, tuple[str, ...]] = {}

    def obey(self, message: bytes) -> None:
        super().obey(message)
        self.publish()
        queue = self.readers[STATES].queue
        if queue and self.robot.robot.tick in self.pressed:
            state = np.frombuffer(queue[-1], np.uint8).copy()
            begin = STATE.at("wireless_remote")
            keys = remote(*self.pressed[self.robot.robot.tick])
            state[begin : begin + 40] = np.frombuffer(keys, np.uint8)
            queue[-1] = STATE.sealed(state.view("<u4"))


def started(at: dict[int, Event]) -> tuple[LiveBus, ControlledRobot, Keys, list[str]]:
    bus, keys, words = LiveBus(), Keys(at), []
    return bus, ControlledRobot(bus, TRUTHS, DT_S, FakeClock(), keys, words.append), keys, words


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


def test_the_remote_starts_and_stops_it() -> None:
    bus, robot, _, _ = started({})
    bus.pressed = {50: ("start",), 2500: ("A",), 2520: ("select",)}
    seen = robot.first()
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


def test_a_command_that_is_not_finite_damps_it() -> None:
    bus, robot, _, _ = started(BY_TERMINAL)
    seen = robot.exchange(robot.first(), HOLD)
    with pytest.raises(RobotLostError, match="a command of the policy is not finite"):
        robot.exchange(seen, HOLD._replace(q=np.full(19, np.nan)))
    assert (sent(bus)[-1].kd == DAMPING.kd).all()


def test_stop_before_the_run_is_left_by_arming_again() -> None:
    again = {10: Event.START, 20: Event.STOP, 30: Event.REARM, 40: Event.START, 500: Event.RUN}
    _, robot, _, words = started(again)
    robot.first()
    states = [line.split(".")[0].removeprefix("robot: ") for line in words]
    assert states[:4] == ["zero torque", "ramp", "damping", "zero torque"]
    assert states[-1] == "run"


def test_a_robot_that_falls_silent_before_the_run_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(over_dds, "FIRST_S", 0.3)
    bus, robot, _, _ = started({})
    bus.pressed = {}
    monkeypatch.setattr(bus, "obey", lambda message: None)
    bus.commands._obey = bus.obey
    with pytest.raises(RobotLostError, match="allowed 40 ms"):
        robot.first()
