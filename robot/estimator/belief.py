"""The filter's belief about the robot's motion, and its uncertainty.

The state is X = (R, v, p, d_1 ... d_n) in SE_(n+2)(3), and biases (b_g, b_a): orientation, velocity
and place of the IMU in the world, and places of the contacts. Its error is right-invariant:

    exp(xi) = X_believed X_true^-1,    zeta = (b_g, b_a)_believed - (b_g, b_a)_true

Source: Hartley et al. 2020 (see `group`), on the state and on the augmentation by biases.
"""

from typing import NamedTuple

import numpy as np

from spikeport.robot.estimator import group
from spikeport.robot.estimator.group import Pose
from spikeport.robot.feet import POINTS

VELOCITY, PLACE, FIRST_CONTACT = 0, 1, 2
"""Rows of the vectors of a pose."""

N_VECTORS = FIRST_CONTACT + len(POINTS)
N_ERRORS = 3 + 3 * N_VECTORS + 6
ROTATION = slice(0, 3)
GYROSCOPE_BIAS, ACCELEROMETER_BIAS = (
    slice(N_ERRORS - 6, N_ERRORS - 3),
    slice(N_ERRORS - 3, N_ERRORS),
)


def errors_of(row: int) -> slice:
    """Return the slice of the covariance that belongs to a vector of the pose."""
    return slice(3 + 3 * row, 6 + 3 * row)


class Belief(NamedTuple):
    """A state with its uncertainty; a contact that does not stand is at 0 and has no error.

    Attributes
    ----------
    pose : Pose
        X, with vectors (6, 3): v, p and four contacts.
    gyroscope_bias, accelerometer_bias : ndarray, (3,)
        In rad/s and m/s^2.
    covariance : ndarray, (27, 27)
        The covariance of the errors.
    """

    pose: Pose
    gyroscope_bias: np.ndarray
    accelerometer_bias: np.ndarray
    covariance: np.ndarray


class Observation(NamedTuple):
    """A linear observation of a belief's errors.

    Attributes
    ----------
    innovation : ndarray, (m,)
        z, observed minus expected.
    sensitivity : ndarray, (m, 27)
        H, derivative of the expected value with respect to a correction delta.
    noise : ndarray, (m, m)
        N, covariance of the observed value.
    """

    innovation: np.ndarray
    sensitivity: np.ndarray
    noise: np.ndarray


def corrected(belief: Belief, observation: Observation) -> Belief:
    """Return a belief after an observation.

        S = H P H^T + N,    K = P H^T S^-1,    delta = K z
        X <- exp(delta) X,  b <- b + delta_b,  P <- (I - K H) P (I - K H)^T + K N K^T

    Source: the paper's right-invariant correction, with Joseph's form of the covariance.
    """
    innovation, sensitivity, noise = observation
    crossed = belief.covariance @ sensitivity.T
    # S is symmetric, so K^T = S^-1 (P H^T)^T: no inverse is formed.
    gain = np.linalg.solve(sensitivity @ crossed + noise, crossed.T).T
    delta = gain @ innovation
    kept = np.eye(N_ERRORS) - gain @ sensitivity
    return Belief(
        group.multiply(group.exp(delta[: GYROSCOPE_BIAS.start]), belief.pose),
        belief.gyroscope_bias + delta[GYROSCOPE_BIAS],
        belief.accelerometer_bias + delta[ACCELEROMETER_BIAS],
        # Joseph's form stays symmetric and positive under rounding; (I - K H) P does not.
        kept @ belief.covariance @ kept.T + gain @ noise @ gain.T,
    )
