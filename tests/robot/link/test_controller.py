import numpy as np
import pytest

from spikeport.robot.description import GAINS, JOINTS
from spikeport.robot.link.admission import LATEST_S
from spikeport.robot.link.controller import RAMP_S, Controller
from spikeport.robot.link.controller_states import MOVING, Event, State
from spikeport.robot.link.h1 import DAMPING, ZERO_TORQUE
from spikeport.robot.signals import MotorCommands, Sensors
from tests.helpers.standing_robot import POSE_RAD, STANDING, N, remote

DT_S = 0.005
KP = np.array([GAINS[joint].kp for joint in JOINTS])


class Robot:
    """A controller with a fake clock, whose robot sends a state every 5 ms."""

    def __init__(self) -> None:
        self.asked: list[float] = []
        self.action = MotorCommands(*(np.full(N, 1.0 + i) for i in range(5)))
        self.controller = Controller(self.policy)
        self.time_s = 0.0

    def policy(self, sensors: Sensors) -> MotorCommands:
        self.asked.append(sensors.time_s)
        return self.action

    def send(self, *keys: str) -> MotorCommands:
        self.time_s += DT_S
        return self.again(STANDING._replace(time_s=self.time_s), *keys)

    def again(self, sensors: Sensors, *keys: str, late_s: float = 0.0) -> MotorCommands:
        """Send an observation as it is, whatever its time."""
        return self.controller.answer(sensors, remote(*keys), self.time_s + late_s)

    def to(self, state: State) -> "Robot":
        """Bring the controller into a state by the remote's keys."""
        order = [State.WAIT, State.ZERO_TORQUE, State.RAMP, State.HOLD, State.RUN]
        if state is State.DAMPING:
            self.to(State.RUN).send("select")
        for passed in order[1 : order.index(state) + 1] if state in order else ():
            keys = {State.RAMP: ("start",), State.RUN: ("A",)}.get(passed, ())
            self.send(*keys)
            while passed is State.HOLD and self.controller.state is State.RAMP:
                self.send()
        assert self.controller.state is state
        return self


@pytest.fixture
def robot() -> Robot:
    return Robot()


def same(one: MotorCommands, other: MotorCommands) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_the_first_observation_is_answered_by_zero_torque(robot):
    assert robot.controller.state is State.WAIT
    assert same(robot.send(), ZERO_TORQUE)
    assert robot.controller.state is State.ZERO_TORQUE


def test_the_ramp_leads_from_the_first_angles_to_the_default_pose_in_two_seconds(robot):
    robot.to(State.ZERO_TORQUE)
    bent = POSE_RAD + 0.05
    robot.time_s += DT_S
    commands = [robot.again(STANDING._replace(time_s=robot.time_s, q=bent), "start")]
    while robot.controller.state is State.RAMP:
        commands.append(robot.send())
    np.testing.assert_array_equal(commands[0].q, bent)
    np.testing.assert_allclose(commands[len(commands) // 2].q, POSE_RAD + 0.025, atol=2e-4)
    np.testing.assert_array_equal(commands[-1].q, POSE_RAD)
    assert len(commands) - 1 == pytest.approx(RAMP_S / DT_S, abs=1)
    assert all(np.array_equal(c.kp, KP) and not c.tau.any() for c in commands)
    assert robot.controller.state is State.HOLD


def test_the_pose_is_held_until_the_run_key_starts_the_policy(robot):
    robot.to(State.HOLD)
    for _ in range(10):
        np.testing.assert_array_equal(robot.send().q, POSE_RAD)
    assert robot.asked == []
    assert same(robot.send("A"), robot.action)
    assert robot.asked == [robot.time_s]
    robot.send()
    assert len(robot.asked) == 2


def test_the_pose_stays_the_target_even_if_joints_sag(robot):
    robot.to(State.HOLD).time_s += DT_S
    sagging = STANDING._replace(time_s=robot.time_s, q=POSE_RAD + 0.05)
    np.testing.assert_array_equal(robot.again(sagging).q, POSE_RAD)


def test_the_run_key_does_nothing_before_the_ramp_is_over(robot):
    robot.to(State.RAMP).send("A")
    assert robot.controller.state is State.RAMP


def test_a_key_that_is_down_from_the_start_does_nothing_unless_it_is_stop(robot):
    robot.send("start")
    robot.send("start")
    assert robot.controller.state is State.ZERO_TORQUE
    robot.send("select")
    assert robot.controller.state is State.DAMPING


@pytest.mark.parametrize("state", State)
def test_a_refusal_damps_a_moving_robot_and_does_not_ask_the_policy(robot, state):
    robot.to(state)
    n_asked = len(robot.asked)
    robot.controller.refuse("its checksum is wrong")
    found = robot.again(STANDING._replace(time_s=robot.time_s))
    damped = state in MOVING or state is State.DAMPING
    if state is not State.WAIT:
        assert robot.controller.state is (State.DAMPING if damped else state)
    assert same(found, DAMPING if damped else ZERO_TORQUE)
    assert robot.controller.refused == "its checksum is wrong"
    assert robot.controller.refusals == 1
    assert len(robot.asked) == n_asked


@pytest.mark.parametrize("state", State)
def test_a_moving_robot_that_is_silent_for_40_ms_is_damped(robot, state):
    robot.to(state)
    controller = robot.controller
    assert not controller.watch(robot.time_s + LATEST_S - 1e-6)
    assert controller.state is state
    assert controller.watch(robot.time_s + LATEST_S + 1e-3) is (state in MOVING)
    assert controller.state is (State.DAMPING if state in MOVING else state)


def test_a_state_that_comes_too_late_is_answered_by_damping(robot):
    robot.to(State.RUN)
    robot.time_s += 0.05
    assert same(robot.send(), DAMPING)
    assert "no new state for 55 ms, allowed 40 ms" in robot.controller.refused


def test_a_robot_that_repeats_an_old_state_counts_as_silent(robot):
    robot.to(State.RUN)
    old, n_asked = STANDING._replace(time_s=robot.time_s), len(robot.asked)
    answers = [robot.again(old, late_s=i * DT_S) for i in range(10)]
    assert len(robot.asked) == n_asked
    assert all(same(answer, robot.action) for answer in answers[:8])
    assert same(answers[9], DAMPING)


def test_delays_up_to_40_ms_and_lost_states_do_not_stop_a_run(robot):
    robot.to(State.RUN)
    rng = np.random.RandomState(0)
    for _ in range(400):
        robot.time_s += DT_S * rng.randint(0, 7)
        assert same(robot.send(), robot.action)


@pytest.mark.parametrize("value", [np.nan, np.inf, 45.0])
def test_a_command_of_the_policy_beyond_the_limits_damps_the_robot(robot, value):
    """A target of 45 stands for one in degrees."""
    robot.to(State.RUN)
    robot.action = robot.action._replace(q=np.full(N, value))
    assert same(robot.send(), DAMPING)
    assert robot.controller.state is State.DAMPING
    reason = f"a command of the policy: q of {JOINTS[0]} is {value:g}, allowed -6.28319 to 6.28319"
    assert robot.controller.damped_for == reason


def test_a_stop_does_not_take_its_reason_from_an_earlier_refusal(robot):
    robot.to(State.HOLD)
    robot.controller.refuse("its checksum is wrong")
    assert robot.controller.damped_for == "its checksum is wrong"
    robot.send("L1", "R1")
    robot.to(State.RUN)
    robot.controller.happen(Event.STOP)
    assert robot.controller.state is State.DAMPING
    assert robot.controller.damped_for == ""
    assert robot.controller.refused == "its checksum is wrong"


def test_the_stop_key_of_a_terminal_counts_even_if_no_newer_state_comes(robot):
    robot.to(State.RUN)
    robot.controller.happen(Event.STOP)
    assert same(robot.again(STANDING._replace(time_s=robot.time_s)), DAMPING)


def test_damping_lasts_until_arming_again_restarts_the_controller(robot):
    robot.to(State.DAMPING)
    for _ in range(100):
        assert same(robot.send(), DAMPING)
    robot.send("start", "A")
    assert robot.controller.state is State.DAMPING
    assert same(robot.send("L1", "R1"), ZERO_TORQUE)
    assert robot.controller.state is State.WAIT
    assert same(robot.send(), ZERO_TORQUE)
    assert robot.controller.state is State.ZERO_TORQUE
    robot.to(State.ZERO_TORQUE)


def test_a_robot_that_reboots_while_damped_can_be_armed_again(robot):
    robot.to(State.DAMPING)
    robot.controller.happen(Event.REARM)
    robot.time_s = 0.0
    assert same(robot.send(), ZERO_TORQUE)
    assert robot.controller.state is State.ZERO_TORQUE


def test_a_robot_that_is_silent_cannot_be_armed_again(robot):
    robot.to(State.DAMPING)
    held = STANDING._replace(time_s=robot.time_s)
    robot.again(held)
    robot.controller.happen(Event.REARM)
    robot.again(held)
    assert robot.controller.state is State.WAIT
    robot.send()
    assert robot.controller.state is State.ZERO_TORQUE


def test_every_arrival_is_answered_by_a_complete_and_finite_command(robot):
    """This holds in every state, after refusals and after gaps."""
    rng = np.random.RandomState(1)
    keys = ("start", "A", "select", "L1", "R1")
    for _ in range(5000):
        robot.time_s += DT_S * rng.choice([0, 1, 1, 1, 1, 1, 20], p=[0.1, *5 * (0.179,), 0.005])
        if rng.rand() < 0.002:
            robot.controller.refuse("its checksum is wrong")
        pressed = rng.choice(keys, rng.randint(3), replace=False)
        found = robot.again(STANDING._replace(time_s=robot.time_s), *pressed)
        assert all(v.shape == (N,) and np.isfinite(v).all() for v in found)
        if robot.controller.state not in MOVING:
            assert not found.kp.any()
            assert not found.tau.any()
