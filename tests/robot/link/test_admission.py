import numpy as np
import pytest

from spikeport.robot.description import JOINTS, load
from spikeport.robot.link.admission import MARGIN, PLAUSIBLE_MARGIN_RAD, beyond, h1_limits
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S, TORQUE_LIMITS_NM
from tests.helpers.standing_robot import LIMITS, STANDING, spoilt


def test_a_standing_robot_is_trusted():
    assert beyond(STANDING, LIMITS) is None


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [("q", 0.6, "rad"), ("q", -0.6, "rad"), ("dq", 21.0, "rad/s"), ("torque", -201.0, "N m")],
)
def test_what_is_beyond_a_limit_is_refused_with_joint_value_and_limit(name, value, unit):
    found = beyond(spoilt(STANDING, name, value), LIMITS)
    assert found is not None
    assert found.startswith(f"{name} of {JOINTS[0]} is {value:.3g} {unit}, allowed ")


@pytest.mark.parametrize(("name", "value"), [("gyroscope", -51.0), ("accelerometer", 301.0)])
def test_what_no_imu_measures_is_refused(name, value):
    found = beyond(spoilt(STANDING, name, value), LIMITS)
    assert found is not None
    assert found.startswith(f"{name} is {abs(value):g}")


def test_limits_are_those_of_the_model_and_of_the_motors():
    ranges = load().jnt_range[1:]
    limits = h1_limits()
    np.testing.assert_allclose(limits.low_rad, ranges[:, 0] - PLAUSIBLE_MARGIN_RAD)
    np.testing.assert_allclose(limits.high_rad, ranges[:, 1] + PLAUSIBLE_MARGIN_RAD)
    np.testing.assert_allclose(limits.speed_rad_s, MARGIN * SPEED_LIMITS_RAD_S)
    np.testing.assert_allclose(limits.torque_nm, MARGIN * TORQUE_LIMITS_NM)
