"""What a refitted read-out is right about, where it must choose."""

import numpy as np
import pytest

from spikeport.experiments.policy.refitting import (
    LAG,
    NOISE,
    RECURRING,
    STRIDE,
    Played,
    emphasise,
    refit_lagged,
)
from spikeport.networks.policy import Readout

T = np.arange(20 * STRIDE)[:, np.newaxis]
SLOW, STEPS = np.sin(2 * np.pi * T / 1000), np.sin(2 * np.pi * T / 20)
ONE = Readout(np.ones((1, 1)), np.zeros(1))
WITHIN = slice(STRIDE, -STRIDE)
"""Where a moving average has all its values."""


def noise(sd):
    return sd * np.random.RandomState(0).randn(len(T), 1)


def late(halves, exact):
    """Played halves that come when they are due."""
    return Played(np.roll(halves, LAG, axis=0), exact)


def slope_alone(halves, exact):
    """Of least squares on all errors alike."""
    return float(np.linalg.lstsq(halves, exact, rcond=None)[0][0, 0])


@pytest.mark.parametrize(
    ("values", "exact", "kept"),
    [
        (np.full_like(STEPS, 5.0), STEPS, 1),
        (STEPS, STEPS, 1 / RECURRING),
        (STEPS, np.cos(2 * np.pi * T / 20), 1 / NOISE),
    ],
)
def test_what_lasts_is_kept_and_the_rest_is_lessened(values, exact, kept):
    found = emphasise(values, exact)
    np.testing.assert_allclose(found[WITHIN], kept * values[WITHIN], atol=5e-3)


def test_a_readout_is_right_about_what_lasts():
    halves = SLOW + STEPS
    found = refit_lagged(ONE, late(halves, SLOW))
    assert slope_alone(halves, SLOW) == pytest.approx(0.5, abs=0.01)
    assert found.weights[0, 0] > 0.95


def test_noise_hardly_shrinks_what_recurs():
    halves = STEPS + noise(0.7)
    found = refit_lagged(ONE, late(halves, STEPS))
    assert slope_alone(halves, STEPS) == pytest.approx(0.5, abs=0.02)
    assert found.weights[0, 0] > 0.8


def test_a_readout_that_is_right_stays_as_it_is():
    exact = np.column_stack((SLOW, STEPS))
    nominal = Readout(np.array([[1.0, -2.0], [0.5, 3.0]]), np.array([0.1, -0.2]))
    found = refit_lagged(nominal, late(exact, exact), late(exact[::-1], exact[::-1]))
    np.testing.assert_allclose(found.weights, nominal.weights, atol=1e-9)
    np.testing.assert_allclose(found.bias, nominal.bias, atol=1e-9)
