"""Random beliefs of a filter, and their differences."""

from collections.abc import Callable

import numpy as np

from spikeport.robot.estimator import group
from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    GYROSCOPE_BIAS,
    N_ERRORS,
    N_VECTORS,
    Belief,
)
from spikeport.robot.estimator.group import Pose
from tests.helpers.lie_group import inverse, log


def random_belief(seed: int) -> Belief:
    """Return a belief with an arbitrary covariance."""
    rng = np.random.RandomState(seed)
    rotation = group.gammas(rng.standard_normal(3))[0]
    root = rng.standard_normal((N_ERRORS, N_ERRORS)) / N_ERRORS
    vectors = rng.standard_normal((N_VECTORS, 3))
    biases = 0.1 * rng.standard_normal((2, 3))
    return Belief(Pose(rotation, vectors), biases[0], biases[1], root @ root.T)


def moved_by(belief: Belief, delta: np.ndarray) -> Belief:
    """Return the belief with a correction (27,) added: exp(delta) X, and biases."""
    return belief._replace(
        pose=group.multiply(group.exp(delta[: GYROSCOPE_BIAS.start]), belief.pose),
        gyroscope_bias=belief.gyroscope_bias + delta[GYROSCOPE_BIAS],
        accelerometer_bias=belief.accelerometer_bias + delta[ACCELEROMETER_BIAS],
    )


def difference(belief: Belief, true: Belief) -> np.ndarray:
    """Return the errors (27,) of a belief."""
    error = group.multiply(belief.pose, inverse(true.pose))
    return np.concatenate(
        (
            log(error),
            belief.gyroscope_bias - true.gyroscope_bias,
            belief.accelerometer_bias - true.accelerometer_bias,
        )
    )


def slope(function: Callable[[np.ndarray], np.ndarray], step: float = 1e-6) -> np.ndarray:
    """Return the derivative of a function of a correction (27,) at 0, by central differences."""
    columns = [function(step * e) - function(-step * e) for e in np.eye(N_ERRORS)]
    return np.array(columns).T / (2 * step)
