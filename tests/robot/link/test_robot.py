"""The simulated robot: its torque law and limits, its watchdog, and its refusals."""

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.link.codec import Command, decode_base, decode_state, encode_command
from spikeport.robot.link.h1 import DAMPING, SPEED_LIMITS_RAD_S, TORQUE_LIMITS_NM
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import MotorCommands, Sensors
from spikeport.robot.walk_interface import POSE_RAD

NONE = np.zeros(len(JOINTS))
HOLD = MotorCommands(POSE_RAD, NONE, np.full(19, 100.0), np.full(19, 5.0), NONE)
ELBOW = JOINTS.index("right_elbow")


def robot(**settings: object) -> SimulatedRobot:
    return SimulatedRobot(RobotSettings(hoist=True, **settings))


def sensors(of: SimulatedRobot) -> Sensors:
    return decode_state(of.state())[1]


def commanded(of: SimulatedRobot, motors: MotorCommands, steps: int) -> Sensors:
    for _ in range(steps):
        of.obey(Command(of.tick, motors))
        of.step()
    return sensors(of)


def torque_of_a_moving_elbow(of: SimulatedRobot, rad_s: float) -> float:
    """Return the torque, in N m, of a step that begins with the elbow at that velocity."""
    of._plant.data.qvel[6 + ELBOW] = rad_s
    mujoco.mj_forward(of._plant.model, of._plant.data)
    of.step()
    return float(sensors(of).torque[ELBOW])


def test_ticks_count_milliseconds_and_begin_one_step_after_0() -> None:
    for rate_hz, ticks in ((200.0, 5), (500.0, 2), (1000.0, 1)):
        one = robot(rate_hz=rate_hz)
        assert one.tick == ticks
        one.step()
        assert (one.tick, one.steps) == (2 * ticks, 1)
        assert decode_state(one.state())[0] == decode_base(one.truth()).tick == 2 * ticks


def test_the_odometer_is_read_once_a_step() -> None:
    one = robot(odometer=OdometerErrors())
    first = one.odometry()
    assert first is not None
    assert one.odometry() == first
    one.step()
    assert one.odometry() != first


def test_a_posture_beyond_a_joints_stops_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        robot(posture_rad={"left_knee": 9.0})
    assert str(caught.value) == (
        "left_knee=9: must be between the joint's stops, -0.26 and 2.05 rad"
    )


def test_a_joint_moves_to_its_target() -> None:
    target = POSE_RAD.copy()
    target[ELBOW] = 0.2
    found = commanded(robot(), HOLD._replace(q=target), 400)
    assert found.q[ELBOW] == pytest.approx(0.2, abs=0.05)


def test_torques_follow_tau_and_gains_within_the_motors_limits() -> None:
    one, tau = robot(), np.zeros(19)
    tau[ELBOW] = 3.0
    commanded(one, DAMPING._replace(kd=NONE, tau=tau), 1)
    assert sensors(one).torque[ELBOW] == pytest.approx(3.0)
    far = HOLD._replace(q=POSE_RAD + 1.0, kp=np.full(19, 5000.0))
    found = commanded(robot(), far, 1)
    np.testing.assert_allclose(found.torque, TORQUE_LIMITS_NM, rtol=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_motor_at_its_largest_speed_brakes_but_does_not_accelerate(sign: int) -> None:
    limit = SPEED_LIMITS_RAD_S[ELBOW]
    for speed, asked, torque in ((limit - 1, 18, 18), (limit, 18, 0), (limit, -18, -18)):
        one, tau = robot(), np.zeros(19)
        tau[ELBOW] = sign * asked
        one.obey(Command(one.tick, DAMPING._replace(kd=NONE, tau=tau)))
        assert torque_of_a_moving_elbow(one, sign * speed) == pytest.approx(sign * torque)


def test_the_watchdog_damps_the_robot_until_the_next_command() -> None:
    one = robot(watchdog_s=0.1)
    commanded(one, HOLD, 1)
    trips = []
    for _ in range(30):
        one.step()
        trips.append(one.watchdog_trips)
    # the command was obeyed at 5 ms; the step that begins 100 ms later damps
    assert trips == [0] * 19 + [1] * 11
    assert torque_of_a_moving_elbow(one, 2.0) == pytest.approx(-16.0)
    commanded(one, HOLD, 1)
    assert one.watchdog_trips == 1
    for _ in range(40):
        one.step()
    assert one.watchdog_trips == 2


def test_until_the_first_command_the_robot_is_damped_and_waits() -> None:
    one = robot()
    assert one.waits
    for _ in range(40):
        one.step()
    assert one.watchdog_trips == 0
    assert torque_of_a_moving_elbow(one, -1.5) == pytest.approx(12.0)
    commanded(one, HOLD, 1)
    assert not one.waits


def test_a_command_that_is_damaged_or_beyond_limits_is_counted_and_not_obeyed() -> None:
    one = robot()
    good = encode_command(Command(one.tick, HOLD))
    assert one.read(good[:-1], 1) is None
    assert one.read(good[:-1] + bytes([good[-1] ^ 1]), 1) is None
    assert one.refusals.damaged == 2
    assert "checksum" in one.last_refusal
    bad = one.read(encode_command(Command(one.tick, HOLD._replace(q=POSE_RAD + np.nan))), 1)
    assert bad is not None
    one.obey(bad)
    assert one.refusals.beyond_limits == 1
    assert one.waits


def test_a_second_writer_is_refused_until_the_first_is_gone() -> None:
    one = robot()
    message = encode_command(Command(one.tick, HOLD))
    assert one.read(message, 7) is not None
    assert one.read(message, 8) is None
    assert not one.is_left([7, 8])
    assert one.is_left([8])
    one.forget_writer()
    assert not one.is_left([8])
    assert one.read(message, 8) is not None
    assert one.read(message, 7) is None
    assert one.refusals.second_writer == 2


def test_the_writer_of_a_damaged_message_does_not_claim_the_robot() -> None:
    one = robot()
    assert one.read(b"nonsense", 7) is None
    assert one.read(encode_command(Command(one.tick, HOLD)), 8) is not None


def test_a_command_is_refused_and_counted_until_sport_mode_is_released() -> None:
    one = robot(sport_mode="ai")
    message = encode_command(Command(one.tick, HOLD))
    assert one.read(message, 7) is None
    assert one.refusals.sport_mode == 1
    assert one.last_refusal == "the robot is in mode 'ai'; release it first"
    one.sport_mode = ""
    assert one.read(message, 8) is not None  # the refused message claimed the robot for nobody


def test_a_restart_repeats_the_first_state_and_the_motion() -> None:
    one = robot(seed=3)
    first = one.state()
    commanded(one, HOLD, 20)
    motion = one.summary()["motion"]
    one.restart()
    assert one.state() == first
    assert one.waits
    commanded(one, HOLD, 20)
    assert one.summary()["motion"] == motion


@pytest.mark.parametrize("part", ["qpos", "qvel"])
@pytest.mark.parametrize("index", [0, 9, -1])
def test_the_digest_of_the_motion_covers_every_bit_of_positions_and_velocities(
    part: str, index: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    digests = []
    for change in (0.0, 1e-15):
        one = robot(seed=3)
        monkeypatch.setattr(one._plant, "step", lambda: None)
        getattr(one._plant.data, part)[index] += change
        one.step()
        digests.append(one.summary()["motion"])
    assert digests[0] != digests[1]


def test_a_restart_resets_the_report() -> None:
    one = robot()
    fresh = one.summary()
    assert one.read(b"nonsense", 1) is None
    commanded(one, HOLD, 1)
    for _ in range(30):
        one.step()
    assert (one.refusals.damaged, one.watchdog_trips) == (1, 1)
    one.restart()
    assert one.summary() == fresh


def test_a_limp_robot_hangs_on_its_hoist_and_falls_without_it() -> None:
    heights = []
    for hoist in (True, False):
        one = SimulatedRobot(RobotSettings(hoist=hoist))
        commanded(one, DAMPING, 300)
        heights.append(decode_base(one.truth()).position[2])
    assert heights[0] == pytest.approx(1.06, abs=0.01)
    assert heights[1] < 0.7


def test_a_robot_starts_in_the_posture_of_its_settings() -> None:
    found = sensors(robot(posture_rad={"right_elbow": 1.0}))
    assert found.q[ELBOW] == pytest.approx(1.0, abs=0.03)
