from dataclasses import replace

import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.estimator import footholds, torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.belief import (
    FIRST_CONTACT,
    GYROSCOPE_BIAS,
    PLACE,
    ROTATION,
    errors_of,
)
from spikeport.robot.estimator.contact_aided_ekf import ContactAidedEkf, EkfNoise
from spikeport.robot.estimator.legs import LEG_JOINTS, Legs
from spikeport.robot.state import RobotState
from tests.helpers.standing_robot import STANDING

DT_S = 0.005


def loaded() -> np.ndarray:
    """Return joint torques (19,) with which each leg carries 250 N."""
    soles, torque = Legs().soles(STANDING.q), np.zeros(len(JOINTS))
    for side in range(2):
        middle = soles.jacobians[2 * side : 2 * side + 2].mean(axis=0)
        torque[:LEG_JOINTS] -= middle.T @ (0.0, 0.0, 250.0)
    return torque


STILL = STANDING._replace(torque=loaded())


def stood(ekf: ContactAidedEkf, seconds: float, **values: object) -> RobotState:
    """Return the state after a robot stood for a time, with some values of its sensors replaced."""
    sensors = STILL._replace(**values)
    found = ekf.reset(sensors)
    for step in range(1, round(seconds / DT_S) + 1):
        found = ekf.update(sensors._replace(time_s=step * DT_S))
    return found


def tilted(angle_rad: float) -> np.ndarray:
    return np.array([np.cos(angle_rad / 2), np.sin(angle_rad / 2), 0.0, 0.0])


def test_the_estimate_of_a_robot_that_stands_still_does_not_move():
    ekf = ContactAidedEkf()
    found = stood(ekf, 1.0)
    assert ekf.standing.all()
    np.testing.assert_allclose(found.base_linear_velocity, 0.0, atol=1e-3)
    np.testing.assert_allclose(found.base_angular_velocity, 0.0, atol=1e-4)
    np.testing.assert_allclose(found.base_position[:2], 0.0, atol=1e-3)
    np.testing.assert_allclose(torso.rotation(found.base_quaternion), np.eye(3), atol=1e-3)
    np.testing.assert_array_equal(found.q, STILL.q)


@pytest.mark.slow
def test_gyroscope_biases_about_horizontal_axes_are_estimated():
    ekf, bias = ContactAidedEkf(), np.array([0.01, -0.008, 0.0])
    found = stood(ekf, 10.0, gyroscope=bias)
    np.testing.assert_allclose(ekf.belief.gyroscope_bias[:2], bias[:2], atol=1e-3)
    np.testing.assert_allclose(found.base_angular_velocity[:2], 0.0, atol=1e-3)
    np.testing.assert_allclose(found.base_linear_velocity, 0.0, atol=2e-3)


@pytest.mark.slow
def test_a_wrong_tilt_of_the_imu_at_the_start_is_corrected():
    ekf = ContactAidedEkf(EkfNoise(tilt_rad=0.1, accelerometer_bias=0.01))
    found = stood(ekf, 5.0, quaternion=tilted(0.05))
    assert torso.rotation(found.base_quaternion)[2, 1] == pytest.approx(0.0, abs=5e-3)


def test_the_pelvis_below_a_turning_imu_moves_by_the_lever_arm():
    """v_pelvis = v_imu - omega x r."""
    omega = np.array([0.5, -1.0, 2.0])
    found = ContactAidedEkf().reset(STILL._replace(gyroscope=omega))
    wanted = -np.cross(omega, torso.IMU_OFFSET_M)
    np.testing.assert_allclose(found.base_linear_velocity, wanted, atol=1e-9)


def test_the_heading_is_known_no_better_than_at_the_start():
    ekf = ContactAidedEkf()
    stood(ekf, 0.0)
    assert ekf.belief.covariance[ROTATION, ROTATION][2, 2] == 0.0
    stood(ekf, 1.0)
    after = np.diag(ekf.belief.covariance)[ROTATION]
    assert after[2] > 0  # it was 0 at the start, when the heading is a matter of definition
    assert after[:2].max() < EkfNoise().tilt_rad ** 2


def test_a_robot_in_the_air_has_no_contacts():
    ekf = ContactAidedEkf()
    stood(ekf, 0.2, torque=np.zeros(len(JOINTS)))
    assert not ekf.standing.any()


@pytest.fixture
def displacements(monkeypatch) -> list[np.ndarray]:
    """Return the list of displacements (4, 3) of rolling contacts; each update adds one."""
    found, rolled = [], footholds.rolled
    monkeypatch.setattr(footholds, "rolled", lambda b, d: found.append(d) or rolled(b, d))
    return found


def test_feet_that_turn_with_the_robot_roll_over_the_floor(displacements):
    """A sphere of radius r rolls by (omega x r e_z) dt."""
    forward_rad_s, left_rad_s = 0.3, 0.2
    stood(ContactAidedEkf(), 0.1, gyroscope=np.array([left_rad_s, forward_rad_s, 0.0]))
    radii_m = Legs().radii_m
    rolled = np.stack((forward_rad_s * radii_m, -left_rad_s * radii_m, 0 * radii_m), axis=1)
    np.testing.assert_allclose(displacements[0], rolled * DT_S, rtol=0.05)


def test_feet_that_ankles_hold_level_do_not_roll(displacements):
    ankles = [1.0 if joint.endswith("ankle") else 0.0 for joint in JOINTS]
    rates = {"gyroscope": np.array([0.0, -0.3, 0.0]), "dq": 0.3 * np.array(ankles)}
    stood(ContactAidedEkf(), 0.1, **rates)
    np.testing.assert_allclose(displacements[0], 0.0, atol=1e-9)


def test_contacts_that_left_the_floor_leave_no_estimate_and_no_covariance():
    ekf, rolling = ContactAidedEkf(), np.full(len(JOINTS), 0.5)
    stood(ekf, 0.2, dq=rolling)
    assert ekf.belief.pose.vectors[FIRST_CONTACT:].all()
    for step in range(41, 60):
        in_the_air = STILL._replace(time_s=step * DT_S, torque=np.zeros(len(JOINTS)), dq=rolling)
        ekf.update(in_the_air)
        errors = slice(errors_of(FIRST_CONTACT).start, GYROSCOPE_BIAS.start)
        assert not ekf.belief.pose.vectors[FIRST_CONTACT:].any()
        assert not ekf.belief.covariance[errors].any()


def test_a_new_contact_has_the_uncertainty_of_its_sole():
    def variances(sole_m: float) -> np.ndarray:
        """Return the variances (3,) of a contact from the IMU in the step in which it is added."""
        ekf, step = ContactAidedEkf(EkfNoise(sole_m=sole_m, floor_m=None)), 0
        ekf.reset(STILL)
        while not ekf.standing.any():
            step += 1
            ekf.update(STILL._replace(time_s=step * DT_S))
        contact, place = errors_of(FIRST_CONTACT + int(ekf.standing.argmax())), errors_of(PLACE)
        away = ekf.belief.covariance[contact] - ekf.belief.covariance[place]
        return np.diag(away[:, contact] - away[:, place])

    np.testing.assert_allclose(variances(0.02) - variances(0.01), 0.02**2 - 0.01**2, rtol=1e-6)


def test_an_observation_that_comes_twice_counts_once():
    ekf = ContactAidedEkf()
    stood(ekf, 0.1)
    before = ekf.belief
    ekf.update(STILL._replace(time_s=0.1))
    assert ekf.belief is before


def test_standing_feet_correct_a_velocity_error_of_the_accelerometer():
    """The accelerometer errs for 0.1 s, by 0.1 m/s in all, while the feet stand still."""
    ekf = ContactAidedEkf()
    stood(ekf, 1.0)
    wrong = STILL.accelerometer + np.array([1.0, 0.0, 0.0])
    for step in range(20):
        ekf.update(STILL._replace(time_s=1.0 + (step + 1) * DT_S, accelerometer=wrong))
    for step in range(20, 80):
        found = ekf.update(STILL._replace(time_s=1.0 + (step + 1) * DT_S))
    assert abs(found.base_linear_velocity[0]) < 0.02


def fixes(ekf: ContactAidedEkf, fix: Fix, n: int) -> RobotState:
    for step in range(1, n + 1):
        found = ekf.update(STILL._replace(time_s=step * DT_S), fix)
    return found


@pytest.mark.parametrize("floor_m", [None, 0.05])
def test_the_filter_starts_at_a_fix_on_level_and_on_unknown_floors(floor_m):
    ekf = ContactAidedEkf(replace(EkfNoise(), floor_m=floor_m))
    fix = Fix(np.array([3.0, -2.0, 5.0]), 1.0)
    ekf.reset(STILL, fix)
    found = fixes(ekf, fix, 200)
    np.testing.assert_allclose(found.base_position, fix.position, atol=2e-3)
    assert torso.heading_rad(torso.rotation(found.base_quaternion)) == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(found.base_linear_velocity, 0.0, atol=2e-3)


@pytest.mark.slow
def test_fixes_correct_a_drifted_estimate_and_the_gyroscope_bias_behind_it():
    ekf, bias = ContactAidedEkf(), np.array([0.0, 0.0, 0.01])
    drifted = stood(ekf, 4.0, gyroscope=bias)
    assert torso.heading_rad(torso.rotation(drifted.base_quaternion)) == pytest.approx(
        0.04, abs=5e-3
    )
    fix = Fix(np.array([0.0, 0.0, drifted.base_position[2]]), 0.0)
    for step in range(800, 2400):
        found = ekf.update(STILL._replace(time_s=step * DT_S, gyroscope=bias), fix)
    np.testing.assert_allclose(found.base_position, fix.position, atol=2e-3)
    assert torso.heading_rad(torso.rotation(found.base_quaternion)) == pytest.approx(0.0, abs=2e-3)
    np.testing.assert_allclose(ekf.belief.gyroscope_bias, bias, atol=2e-3)


def test_a_heading_error_adds_to_the_deviation_of_the_place_by_its_distance():
    """A heading error about the origin moves a place by the error times its distance."""
    ekf = ContactAidedEkf()
    ekf.reset(STILL, Fix(np.array([3.0, 4.0, 1.0]), 0.2))
    assert ekf.place_deviation_m == pytest.approx(0.0, abs=1e-9)
    covariance = ekf.belief.covariance.copy()
    covariance[2, 2] += 0.01**2
    ekf.belief = ekf.belief._replace(covariance=covariance)
    assert ekf.place_deviation_m == pytest.approx(0.05)


def test_fixes_far_from_the_origin_do_not_reveal_the_tilt():
    near, far = ContactAidedEkf(), ContactAidedEkf()
    for ekf, east_m in ((near, 0.0), (far, 100.0)):
        fix = Fix(np.array([east_m, 0.0, 1.0]), 0.0)
        ekf.reset(STILL, fix)
        for step in range(1, 4):
            ekf.update(STILL._replace(time_s=step * DT_S), fix)
    tilts = [np.sqrt(np.diag(ekf.belief.covariance)[ROTATION][:2]) for ekf in (near, far)]
    np.testing.assert_allclose(tilts[1], tilts[0], rtol=0.05)
    assert (tilts[0] > 0.01).all()
