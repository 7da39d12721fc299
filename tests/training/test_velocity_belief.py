"""Estimated velocities of training robots."""

import numpy as np
import pytest

from spikeport.training.velocity_belief import EstimatorErrors, VelocityBelief

N = 400
FORWARD = np.tile([0.8, 0.0, 0.0], (N, 1))
STILL = np.zeros((N, 3))


def begun(**errors):
    belief = VelocityBelief(N, EstimatorErrors(**errors), np.random.default_rng(0))
    belief.restart(np.ones(N, bool))
    return belief


def error(belief, age=0.0):
    return belief.estimate(FORWARD, np.full(N, age)) - FORWARD


def test_without_errors_the_velocity_is_known():
    belief = begun()
    belief.update(FORWARD, STILL)
    assert not error(belief).any()


def test_the_error_of_leg_odometry_is_the_delay_of_its_filter_and_the_slip():
    belief, slip = begun(odometry=1.0), np.tile([0.2, 0.0, 0.0], (N, 1))
    belief.update(FORWARD, STILL)
    np.testing.assert_allclose(error(belief)[:, 0], -0.8 * np.exp(-0.02 / 0.03))
    for _ in range(50):
        belief.update(FORWARD, slip)
    np.testing.assert_allclose(error(belief), -slip, atol=1e-9)


def test_late_leg_odometry_is_the_estimate_of_that_time():
    belief = begun(odometry=1.0)
    belief.update(FORWARD, STILL)
    belief.update(FORWARD, STILL)
    then, now = (0.8 * (1 - np.exp(-t / 0.03)) for t in (0.02, 0.04))
    for age, estimate in ((1.0, then), (0.5, (then + now) / 2), (0.0, now)):
        np.testing.assert_allclose(belief.estimate(STILL, np.full(N, age))[:, 0], estimate)


def test_other_estimates_are_off_by_a_factor_and_wander():
    belief = begun(scale=0.2, wander_m_s=0.05)
    for _ in range(100):
        belief.update(FORWARD, STILL)
    assert error(belief)[:, 1].std() == pytest.approx(0.05, rel=0.15)
    assert error(belief)[:, 0].std() == pytest.approx(
        np.hypot(0.8 * 0.2 / np.sqrt(3), 0.05), rel=0.15
    )


def test_a_share_of_the_robots_has_leg_odometry():
    belief = begun(odometry=0.3)
    belief.update(FORWARD, STILL)
    assert 0.2 < error(belief).any(axis=1).mean() < 0.4
