"""Errors and delays of recordings."""

from dataclasses import replace

import numpy as np
import pytest

from spikeport.simulation.recorded import Recorded


def test_the_error_is_relative_and_filtered(ran):
    errors = {name: one.error() for name, one in ran.recorded.items()}
    assert errors.pop("stimulus") == 0
    assert all(0.001 < error < 1 for error in errors.values())
    times_s = np.arange(1, 101) * 0.001
    ones = np.ones((100, 2))
    assert Recorded(times_s, 1.5 * ones, ones, False).error() == pytest.approx(0.5)
    ripple = np.where(np.arange(100) % 2, 1.5, 0.5)[:, np.newaxis]
    assert Recorded(times_s, ripple, ones[:, :1], False).error() < 0.05


def test_the_scale_of_an_error_is_the_rms_of_filtered_values_in_float():
    times_s = np.arange(1, 2001) * 0.001
    ripple = np.where(np.arange(2000) % 2, 2.5, 1.5)[:, np.newaxis]
    one = Recorded(times_s, ripple, ripple, False)
    assert one.rms_float() == pytest.approx(2, rel=0.02)
    assert replace(one, values_float=None).rms_float() is None


def test_the_best_delay_comes_with_the_error_that_remains():
    times_s = np.arange(1, 501) * 0.001
    exact = np.sin(20 * times_s)[:, np.newaxis]
    late = Recorded(times_s, np.roll(exact, 12, axis=0) * (times_s > 0.012)[:, None], exact, False)
    delay_s, error = late.best_delay()
    assert delay_s == pytest.approx(0.012)
    assert error < 1e-6 < 0.1 < late.error()
    assert Recorded(times_s, exact, exact, False).best_delay() is None
    # The error still falls at the longest delay: none is known.
    drifting = Recorded(times_s, np.roll(exact, 80, axis=0), exact, False)
    assert drifting.best_delay() is None


def test_uneven_samples_count_as_evenly_spaced_at_their_mean_distance():
    """Samples are taken every 2.5 ms, in steps of 1 ms."""
    times_s = 0.001 * np.floor(2.5 * np.arange(1, 401))
    exact = np.sin(20 * times_s)[:, np.newaxis]
    late = Recorded(times_s, np.roll(exact, 4, axis=0), exact, False)
    even = replace(late, times_s=0.0025 * np.arange(1, 401))
    assert times_s[1] - times_s[0] == pytest.approx(0.003)
    assert late.best_delay()[0] == pytest.approx(0.01, rel=1e-3)
    assert late.error() == pytest.approx(even.error(), rel=1e-3)


def test_the_error_is_none_without_float_values_scale_or_several_samples(ran):
    one = ran.recorded["stimulus"]
    assert replace(one, values_float=None).error() is None
    assert replace(one, values_float=0 * one.values).error() is None
    assert Recorded(one.times_s[:1], one.values[:1], one.values[:1], False).error() is None
