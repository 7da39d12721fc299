import numpy as np
import pytest

from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    GYROSCOPE_BIAS,
    N_ERRORS,
    N_VECTORS,
    ROTATION,
    Observation,
    corrected,
    errors_of,
)
from tests.helpers.beliefs import difference, moved_by, random_belief


def test_errors_fill_the_covariance_without_gap_or_overlap():
    parts = [ROTATION, *map(errors_of, range(N_VECTORS)), GYROSCOPE_BIAS, ACCELEROMETER_BIAS]
    places = np.concatenate([np.arange(N_ERRORS)[part] for part in parts])
    np.testing.assert_array_equal(places, np.arange(N_ERRORS))


def test_an_exact_observation_of_all_errors_removes_them():
    true = random_belief(0)
    error = 0.1 * np.random.RandomState(1).standard_normal(N_ERRORS)
    belief = moved_by(true, error)
    found = corrected(belief, Observation(-error, np.eye(N_ERRORS), 1e-12 * np.eye(N_ERRORS)))
    np.testing.assert_allclose(difference(found, true), 0.0, atol=1e-6)
    np.testing.assert_allclose(found.covariance, 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_covariances_are_those_of_the_information_form(seed):
    """(P^-1 + H^T N^-1 H)^-1, computed in another way."""
    belief, rng = random_belief(seed), np.random.RandomState(seed)
    sensitivity, noise = rng.standard_normal((5, N_ERRORS)), np.diag(rng.uniform(0.1, 1, 5))
    found = corrected(belief, Observation(np.zeros(5), sensitivity, noise))
    information = (
        np.linalg.inv(belief.covariance) + sensitivity.T @ np.linalg.inv(noise) @ sensitivity
    )
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(difference(found, belief), 0.0, atol=1e-12)


def test_an_observation_with_huge_noise_changes_next_to_nothing():
    belief = random_belief(0)
    useless = Observation(np.ones(2), np.ones((2, N_ERRORS)), 1e12 * np.eye(2))
    np.testing.assert_allclose(difference(corrected(belief, useless), belief), 0.0, atol=1e-9)
