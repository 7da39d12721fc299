"""Estimators on a robot's messages, and their errors where the truth is published."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from spikeport.errors import RobotLostError, UsageError
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import Legs
from spikeport.robot.estimator.registry import (
    BY_ODOMETRY,
    BY_SENSORS,
    EKF,
    EKF_ODOMETER,
    ODOMETER,
    TRUTH,
)
from spikeport.robot.link.client import InlineRobot, Observed
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.messages import ODOMETRY, TRUTHS
from spikeport.robot.link.motion import EstimatedMotion, apart, needed
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import MotorCommands, Sensors
from spikeport.robot.state import RobotState, in_plane
from tests.helpers.standing_robot import POSE_RAD, N

NONE = np.zeros(N)
STAND = MotorCommands(POSE_RAD, NONE, np.full(N, 150.0), np.full(N, 5.0), NONE)
HOIST = Fix(np.array([0.0, 0.0, 1.06]), 0.0)


def observations(n: int, *, hoist: bool = False, truth: bool = True) -> list[Observed]:
    settings = RobotSettings(hoist=hoist, odometer=OdometerErrors())
    robot = InlineRobot(LockStep(SimulatedRobot(settings), tells_truth=truth))
    seen = [robot.first()]
    for _ in range(n):
        seen.append(robot.exchange(seen[-1], STAND))
    return seen


@pytest.mark.parametrize("name", BY_SENSORS)
def test_an_estimator_follows_a_standing_robot_and_reports_its_error_to_the_truth(
    name: str,
) -> None:
    motion, seen = EstimatedMotion(name), observations(40)
    errors = []
    for one in seen:
        found, true = motion(one), EstimatedMotion(TRUTH)(one)
        errors.append(found.base_linear_velocity - true.base_linear_velocity)
        np.testing.assert_array_equal(found.q, one.sensors.q)
        np.testing.assert_allclose(found.base_position, true.base_position, atol=0.05)
    figures = motion.summary()
    assert figures["name"] == name
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    np.testing.assert_allclose(figures["velocity_error_m_s"], rms)
    apart_m = np.linalg.norm((found.base_position - true.base_position)[:2])
    assert figures["place_error_m"] == pytest.approx(apart_m)
    assert figures["heading_error_rad"] == apart(found, true)[1]
    assert figures["recorded"] == "truth"
    np.testing.assert_array_equal(motion.true.base_position, true.base_position)
    assert 0 < rms.max() < 0.3


def truth_moved(seen: Observed, by_m: tuple[float, float]) -> Observed:
    assert seen.truth is not None
    place_m = seen.truth.position + np.array([*by_m, 0.0])
    return seen._replace(truth=seen.truth._replace(position=place_m))


def test_the_error_of_a_robot_that_walked_before_counts_from_the_first_observation() -> None:
    seen = observations(40)
    errors_m: list[Any] = []
    for by_m in ((0.0, 0.0), (4.0, -2.0)):
        motion = EstimatedMotion(EKF)
        for one in seen:
            motion(truth_moved(one, by_m))
        errors_m.append(motion.summary()["place_error_m"])
        assert motion.true is not None
        assert seen[-1].truth is not None
        np.testing.assert_allclose(motion.true.base_position, seen[-1].truth.position, atol=1e-9)
    assert errors_m[1] == pytest.approx(errors_m[0])
    assert errors_m[1] < 0.05


def test_a_truth_that_begins_later_shows_the_drift_until_then() -> None:
    motion, seen = EstimatedMotion(EKF), observations(10)
    for one in seen:
        motion(one._replace(truth=None) if one is seen[0] else truth_moved(one, (1.0, 0.0)))
    assert motion.summary()["place_error_m"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("name", BY_SENSORS)
def test_without_the_truth_an_estimate_has_no_error(name: str) -> None:
    motion = EstimatedMotion(name)
    for one in observations(3, truth=False):
        motion(one)
    figures = motion.summary()
    deviation_m = figures.pop("place_deviation_m")
    if name in (EKF, EKF_ODOMETER):
        assert 0 < deviation_m < 0.05
    else:
        assert deviation_m is None
    assert figures == {
        "name": name,
        "velocity_error_m_s": None,
        "place_error_m": None,
        "heading_error_rad": None,
        "recorded": "estimate",
    }
    assert motion.true is None


def test_without_the_truth_the_estimator_truth_fails() -> None:
    (seen,) = observations(0, truth=False)
    with pytest.raises(RobotLostError, match="give --estimator ekf"):
        EstimatedMotion(TRUTH)(seen)


def test_headings_differ_by_the_short_way_round() -> None:
    (seen,) = observations(0)
    true = EstimatedMotion(TRUTH)(seen)
    east, west = (
        true._replace(
            base_position=true.base_position + offset,
            base_quaternion=np.array([np.cos(yaw_rad / 2), 0, 0, np.sin(yaw_rad / 2)]),
        )
        for yaw_rad, offset in ((3.1, 0.0), (-3.1, [3.0, 4.0, 1.0]))  # the height does not count
    )
    for one, other in ((east, west), (west, east)):
        assert apart(one, other) == pytest.approx((5.0, 2 * np.pi - 6.2))


@pytest.mark.parametrize("name", BY_SENSORS)
def test_no_model_is_compiled_at_the_first_observation(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A robot is damped after 40 ms without its first command; compiling two models took 50 ms."""
    (seen,) = observations(0)
    motion, made = EstimatedMotion(name), []
    monkeypatch.setattr(Legs, "__init__", lambda _legs: made.append(name))
    motion(seen)
    assert made == []


def test_a_truth_of_another_tick_is_not_compared() -> None:
    one, other = observations(1)
    motion = EstimatedMotion(EKF)
    motion(one._replace(truth=other.truth))
    assert motion.summary()["velocity_error_m_s"] is None


@pytest.mark.parametrize("stamp", [0, 10**12])
def test_a_truth_whose_stamps_are_not_the_robots_ticks_is_not_used(stamp: int) -> None:
    """A real robot's sport mode publishes on the topic of a simulation's truth."""
    motion = EstimatedMotion(EKF)
    for one in observations(20):
        motion(one._replace(truth=one.truth._replace(tick=stamp)))
    figures = motion.summary()
    assert motion.true is None
    assert (figures["place_error_m"], figures["recorded"]) == (None, "estimate")


def test_a_truth_that_falls_silent_is_no_longer_used() -> None:
    motion, seen = EstimatedMotion(EKF), observations(20)
    for one in seen[:5]:
        motion(one)
    errors = motion.summary()
    assert errors["recorded"] == "truth"
    for one in seen[5:13]:  # 40 ms
        motion(one._replace(truth=seen[4].truth))
    assert motion.true is not None
    errors = motion.summary()
    motion(seen[13]._replace(truth=seen[4].truth))
    assert motion.true is None
    found = motion.summary()
    assert found["recorded"] == "both"
    for name in ("velocity_error_m_s", "place_error_m", "heading_error_rad"):
        assert found[name] == errors[name]


def test_the_hoists_fix_keeps_the_estimate_where_the_hoist_holds_the_robot() -> None:
    held, loose = EstimatedMotion(EKF, HOIST), EstimatedMotion(EKF)
    for one in observations(200, hoist=True):
        found, free = held(one), loose(one)
    np.testing.assert_allclose(found.base_position, HOIST.position, atol=0.01)
    assert abs(free.base_position[2] - HOIST.position[2]) > 0.02


def test_an_unknown_estimator_is_refused() -> None:
    with pytest.raises(UsageError, match="unknown estimator 'gps'; choose from: ekf, "):
        EstimatedMotion("gps")


@pytest.mark.parametrize("name", BY_ODOMETRY)
def test_an_estimator_by_odometry_fails_without_odometry(name: str) -> None:
    (seen,) = observations(0)
    with pytest.raises(RobotLostError, match="the robot publishes no odometry"):
        EstimatedMotion(name)(seen._replace(odometry=None))


def test_an_estimator_names_the_topic_that_it_needs_beside_the_states() -> None:
    assert [needed(name) for name in (TRUTH, EKF, ODOMETER)] == [TRUTHS, None, ODOMETRY]


def test_a_held_state_does_not_change_the_estimate() -> None:
    motion, seen = EstimatedMotion(EKF_ODOMETER), observations(3)
    for one in seen:
        found = motion(one)
    assert motion(seen[-1]) is found


def test_the_filter_integrates_the_imu_of_the_states_between() -> None:
    """With the rates of one state in five, a robot that turns quickly would seem to turn less."""
    seen = [
        one._replace(sensors=one.sensors._replace(gyroscope=np.array([0.0, 0.0, rate])))
        for one, rate in zip(observations(10), [0.0, *2 * [1.0, 1.0, 1.0, 1.0, 0.0]], strict=True)
    ]
    between = tuple(one.sensors for one in seen)  # with states that came before, and again
    every, fifth = EstimatedMotion(EKF), EstimatedMotion(EKF)
    for one in seen:
        turned = every(one)
    for one in seen[::5]:
        found = fifth(one._replace(between=between))
    heading, wanted = (in_plane(state)[0] for state in (found, turned))
    assert heading == pytest.approx(wanted, abs=1e-3)
    assert wanted > 0.03


@pytest.mark.parametrize("name", BY_ODOMETRY)
def test_each_message_of_odometry_slower_than_the_states_is_used_once(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A repeated old position would hold back the estimate of a walking robot."""
    fixes: list[Fix | None] = []

    class Watched(BY_SENSORS[name]):
        def reset(self, sensors: Sensors, position: Fix | None = None) -> RobotState:
            found = super().reset(sensors, position)
            fixes[:] = [position]  # a reset may call `update`
            return found

        def update(
            self, sensors: Sensors, position: Fix | None = None, between: Sequence[Sensors] = ()
        ) -> RobotState:
            fixes.append(position)
            return super().update(sensors, position, between)

    monkeypatch.setitem(BY_SENSORS, name, Watched)
    seen = observations(40)
    rare = [one._replace(odometry=seen[i - i % 10].odometry) for i, one in enumerate(seen)]
    motion = EstimatedMotion(name)
    for one in rare:
        motion(one)
    assert len(fixes) == 41
    assert [i for i, fix in enumerate(fixes) if fix is not None] == [0, 10, 20, 30, 40]
