import numpy as np
import pytest

from spikeport.robot.description import JOINTS, load
from spikeport.robot.link.admission import MARGIN, PLAUSIBLE_MARGIN_RAD, h1_limits, refusal
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S, TORQUE_LIMITS_NM
from tests.helpers.standing_robot import LIMITS, spoilt, state_message


def test_a_standing_robot_is_trusted():
    assert refusal(state_message(0.0), None, LIMITS) is None
    assert refusal(state_message(0.005), state_message(0.0), LIMITS) is None


def test_a_wrong_crc_is_refused_before_anything_is_read():
    damaged = spoilt(state_message(0.0, intact=False), "q", np.nan)
    assert refusal(damaged, None, LIMITS) == "its CRC is wrong"


def test_another_writer_is_refused():
    assert refusal(state_message(0.1, writer="b"), state_message(0.0, writer="a"), LIMITS) == (
        "written by b, those before by a"
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    "name", ["time_s", "quaternion", "gyroscope", "accelerometer", "q", "dq", "torque"]
)
def test_what_is_not_finite_is_refused_by_name(name, value):
    assert refusal(spoilt(state_message(0.0), name, value), None, LIMITS) == f"{name} is not finite"


def test_a_quaternion_of_no_length_is_refused():
    assert refusal(spoilt(state_message(0.0), "quaternion", 0.0), None, LIMITS) == "quaternion is 0"


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [("q", 0.6, "rad"), ("q", -0.6, "rad"), ("dq", 21.0, "rad/s"), ("torque", -201.0, "N m")],
)
def test_what_is_beyond_a_limit_is_refused_with_joint_value_and_limit(name, value, unit):
    found = refusal(spoilt(state_message(0.0), name, value), None, LIMITS)
    assert found is not None
    assert found.startswith(f"{name} of {JOINTS[0]} is {value:.3g} {unit}, allowed ")


@pytest.mark.parametrize(("name", "value"), [("gyroscope", -51.0), ("accelerometer", 301.0)])
def test_what_no_imu_measures_is_refused(name, value):
    found = refusal(spoilt(state_message(0.0), name, value), None, LIMITS)
    assert found is not None
    assert found.startswith(f"{name} is {abs(value):g}")


def test_a_robot_that_began_anew_is_refused():
    found = refusal(state_message(0.005), state_message(20.0), LIMITS)
    assert found == "the robot's time went back by 19.995 s"
    assert refusal(state_message(19.9), state_message(20.0), LIMITS) is None  # only late


def test_limits_are_those_of_the_model_and_of_the_motors():
    ranges = load().jnt_range[1:]
    limits = h1_limits()
    np.testing.assert_allclose(limits.low_rad, ranges[:, 0] - PLAUSIBLE_MARGIN_RAD)
    np.testing.assert_allclose(limits.high_rad, ranges[:, 1] + PLAUSIBLE_MARGIN_RAD)
    np.testing.assert_allclose(limits.speed_rad_s, MARGIN * SPEED_LIMITS_RAD_S)
    np.testing.assert_allclose(limits.torque_nm, MARGIN * TORQUE_LIMITS_NM)
