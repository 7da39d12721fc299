import numpy as np
import pytest

from spikeport.robot.description import JOINTS, load
from spikeport.robot.link.admission import beyond, h1_limits, too_old
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S, TORQUE_LIMITS_NM
from tests.helpers.standing_robot import LIMITS, STANDING, spoilt

HIP_PITCHES = [i for i, joint in enumerate(JOINTS) if joint.endswith("hip_pitch")]


def test_the_age_of_an_old_state_is_reported_with_the_limit():
    assert too_old(0.05) == "no new state for 50 ms, allowed 40 ms"
    assert too_old(0.3, 0.2) == "no new state for 300 ms, allowed 200 ms"


def test_a_standing_robot_is_trusted():
    assert beyond(STANDING, LIMITS) is None


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [("q", 0.6, "rad"), ("q", -0.6, "rad"), ("dq", 21.0, "rad/s"), ("torque", -201.0, "N m")],
)
def test_a_value_beyond_its_limits_is_reported_with_joint_value_and_limits(name, value, unit):
    found = beyond(spoilt(STANDING, name, value), LIMITS)
    assert found is not None
    assert found.startswith(f"{name} of {JOINTS[0]} is {value:.3g} {unit}, allowed ")


@pytest.mark.parametrize(("name", "value"), [("gyroscope", -51.0), ("accelerometer", 301.0)])
def test_an_imu_value_beyond_its_limit_is_reported(name, value):
    found = beyond(spoilt(STANDING, name, value), LIMITS)
    assert found is not None
    assert found.startswith(f"{name} is {abs(value):g}")


def test_a_folded_robot_is_trusted():
    """Unitree's URDF lets a hip turn twice as far as h1.xml does."""
    folded = STANDING._replace(q=STANDING.q.copy())
    folded.q[HIP_PITCHES] = -2.0
    assert beyond(folded, h1_limits()) is None
    folded.q[HIP_PITCHES] = -3.3
    found = beyond(folded, h1_limits())
    assert found == "q of left_hip_pitch is -3.3 rad, allowed -3.24 to 2.63"


def test_limits_are_the_joint_ranges_and_motor_limits_with_margins():
    low, high = load().jnt_range[1:].T.copy()
    low[HIP_PITCHES], high[HIP_PITCHES] = -3.14, 2.53
    limits = h1_limits()
    np.testing.assert_allclose(limits.low_rad, low - 0.1)
    np.testing.assert_allclose(limits.high_rad, high + 0.1)
    np.testing.assert_allclose(limits.speed_rad_s, 2 * SPEED_LIMITS_RAD_S)
    np.testing.assert_allclose(limits.torque_nm, 2 * TORQUE_LIMITS_NM)
