"""External odometry as an estimate, with the IMU for the values that it lacks."""

import numpy as np

from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.odometer import Odometer
from spikeport.robot.estimator.torso import heading_rad, rotation
from tests.helpers.standing_robot import STANDING

PLACE = np.array([1.0, 2.0, 0.9])


def test_place_and_velocity_are_those_of_the_fix_in_the_frame_of_its_heading() -> None:
    found = Odometer().reset(STANDING, Fix(PLACE, np.pi / 2, np.array([0.0, 0.5, 0.0])))
    np.testing.assert_array_equal(found.base_position, PLACE)
    np.testing.assert_allclose(found.base_linear_velocity, [0.5, 0, 0], atol=1e-12)
    assert abs(heading_rad(rotation(found.base_quaternion)) - np.pi / 2) < 1e-12
    np.testing.assert_array_equal(found.q, STANDING.q)


def test_the_heading_is_that_of_the_fix_whatever_the_imus_heading() -> None:
    turned = STANDING._replace(quaternion=np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)]))
    found = Odometer().reset(turned, Fix(PLACE, 0.5))
    assert abs(heading_rad(rotation(found.base_quaternion)) - 0.5) < 1e-12


def test_values_that_a_fix_lacks_stay_as_they_were() -> None:
    estimator = Odometer()
    estimator.reset(STANDING, Fix(PLACE, 0.5, np.array([0.1, 0.0, 0.0])))
    for fix in (None, Fix(PLACE)):
        found = estimator.update(STANDING, fix)
        np.testing.assert_array_equal(found.base_position, PLACE)
        assert abs(np.linalg.norm(found.base_linear_velocity) - 0.1) < 1e-12
        assert abs(heading_rad(rotation(found.base_quaternion)) - 0.5) < 1e-12


def test_without_a_fix_the_estimate_begins_above_the_origin_at_rest() -> None:
    found = Odometer().reset(STANDING)
    assert found.base_position[:2].tolist() == [0, 0]
    assert 0.9 < found.base_position[2] < 1.1
    assert not found.base_linear_velocity.any()
