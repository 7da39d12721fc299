"""Simulated odometry with stated errors, and fixes by odometry in the frame of a run."""

import numpy as np
import pytest

from spikeport.errors import RobotLostError, UsageError
from spikeport.robot.estimator.torso import quaternion, rotation_z
from spikeport.robot.link.codec import Base, decode_base
from spikeport.robot.link.odometer import OdometerErrors, OdometryFixes, SimulatedOdometer
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from tests.helpers.standing_robot import STANDING

STEP_S = 0.005
EXACT = OdometerErrors(0, 0, 0, 0)


def base(x: float, y: float, yaw_rad: float = 0.0, speed: tuple[float, ...] = (0, 0, 0)) -> Base:
    """Return a motion with this place, heading and velocity."""
    return Base(5, np.array([x, y, 1.0]), np.array(speed), quaternion(rotation_z(yaw_rad)))


def drawn(errors: OdometerErrors, steps: int, seed: int = 0) -> list[Base]:
    odometer = SimulatedOdometer(errors, seed, STEP_S)
    return [odometer.read(base(0, 0)) for _ in range(steps)]


def test_an_exact_odometer_returns_the_true_motion() -> None:
    (found,) = drawn(EXACT, 1)
    for ours, theirs in zip(found, base(0, 0), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_noise_has_the_stated_standard_deviations() -> None:
    found = drawn(OdometerErrors(0.01, 0.03, 0, 0), 2000)
    assert np.std([one.position[0] for one in found]) == pytest.approx(0.01, rel=0.05)
    assert np.std([one.velocity[1] for one in found]) == pytest.approx(0.03, rel=0.05)


def test_position_and_heading_drift_as_stated_and_the_height_does_not_drift() -> None:
    def ends(errors: OdometerErrors) -> list[Base]:
        odometers = [SimulatedOdometer(errors, seed, 0.25) for seed in range(300)]
        return [[odometer.read(base(0, 0)) for _ in range(4)][-1] for odometer in odometers]

    places = [end.position for end in ends(OdometerErrors(0, 0, 0.2, 0))]
    assert np.std([place[0] for place in places]) == pytest.approx(0.2, rel=0.15)
    assert {place[2] for place in places} == {1.0}
    turned = [2 * end.quaternion[3] for end in ends(OdometerErrors(0, 0, 0, 0.1))]
    assert np.std(turned) == pytest.approx(0.1, rel=0.15)


def test_odometry_repeats_after_a_restart_and_is_published_only_if_asked_for() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, odometer=OdometerErrors()))
    first = robot.odometry()
    robot.restart()
    assert robot.odometry() == first
    assert decode_base(first or b"").tick == robot.tick
    assert SimulatedRobot(RobotSettings(hoist=True)).odometry() is None


def test_fixes_begin_above_the_origin_with_the_heading_of_the_imu() -> None:
    fixes = OdometryFixes()
    first = fixes.fix(base(3, 4, np.pi / 2), STANDING)
    np.testing.assert_allclose(first.position[:2], 0, atol=1e-12)
    assert 0.9 < first.position[2] < 1.1
    assert first.yaw_rad == pytest.approx(0)
    ahead = fixes.fix(base(3, 5, np.pi, speed=(0, 1, 0)), STANDING)
    np.testing.assert_allclose(ahead.position[:2], [1, 0], atol=1e-12)
    np.testing.assert_allclose(ahead.velocity, [1, 0, 0], atol=1e-12)
    assert ahead.yaw_rad == pytest.approx(np.pi / 2)


def test_a_fix_by_odometry_that_lost_its_orientation_has_no_heading() -> None:
    fixes = OdometryFixes()
    fixes.fix(base(1, 2, np.pi / 2), STANDING)
    fix = fixes.fix(base(1, 3)._replace(quaternion=np.zeros(4)), STANDING)
    assert fix.yaw_rad is None
    np.testing.assert_allclose(fix.position[:2], [1, 0], atol=1e-12)


def test_odometry_without_an_orientation_is_not_used_to_start_a_run() -> None:
    """Place and velocity would be turned by an unknown angle."""
    blind = base(1, 2)._replace(quaternion=np.zeros(4))
    with pytest.raises(RobotLostError, match=r"odometry without an orientation.*cure: publish"):
        OdometryFixes().fix(blind, STANDING)


def test_an_error_below_0_is_refused() -> None:
    with pytest.raises(UsageError, match="--odometer-error drift_m=-1: must be 0 or more"):
        OdometerErrors(drift_m=-1)
