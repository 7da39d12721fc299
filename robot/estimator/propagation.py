"""Propagation of a belief by the IMU.

    R' = R hat(w),    v' = R a + g,    p' = v,    d_i' = 0
    w = gyroscope - b_g,    a = accelerometer - b_a

Biases walk randomly, and contacts slip. Source: Hartley et al. 2020 (see `group`), on the dynamics
of a robot with contacts, on biases and on discretisation.
"""

from dataclasses import dataclass

import numpy as np

from spikeport.robot.estimator import group
from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    FIRST_CONTACT,
    GYROSCOPE_BIAS,
    N_ERRORS,
    PLACE,
    ROTATION,
    VELOCITY,
    Belief,
    errors_of,
)
from spikeport.robot.estimator.group import Pose, hat

FREE_FALL_M_S2 = np.array([0.0, 0.0, -9.81])
"""Acceleration of free fall, g in the equations; an accelerometer at rest reads the opposite."""
_FREE_FALL_HAT = hat(FREE_FALL_M_S2)
_EYE = np.eye(3)


@dataclass(frozen=True)
class ImuNoise:
    """Noise densities; each has the unit below per sqrt(Hz).

    Attributes
    ----------
    gyroscope, accelerometer : float
        The density of white noise, rad/s and m/s^2.
    gyroscope_walk, accelerometer_walk : float
        The density of the biases' random walks, rad/s^2 and m/s^3.
    slip, sinking : float
        The velocity of a contact that stands, along the floor and across it, m/s.
    """

    gyroscope: float = 0.002
    accelerometer: float = 0.05
    gyroscope_walk: float = 1e-4
    accelerometer_walk: float = 1e-3
    slip: float = 0.05
    sinking: float = 0.2


def transition(belief: Belief, dt_s: float) -> np.ndarray:
    """Return the transition matrix of errors, Phi (27, 27) = exp(A dt), up to dt^2.

    A is 0 except for hat(g) from rotation to velocity, I from velocity to place, and -Ad_X from the
    biases, which are in the IMU's frame.
    """
    a = np.zeros((N_ERRORS, N_ERRORS))
    a[errors_of(VELOCITY), ROTATION] = _FREE_FALL_HAT
    a[errors_of(PLACE), errors_of(VELOCITY)] = _EYE
    a[: GYROSCOPE_BIAS.start, GYROSCOPE_BIAS] = -group.turning(belief.pose)
    a[errors_of(VELOCITY), ACCELEROMETER_BIAS] = -belief.pose.rotation
    a *= dt_s
    return np.eye(N_ERRORS) + a + a @ a / 2


def growth(belief: Belief, standing: np.ndarray, noise: ImuNoise) -> np.ndarray:
    """Return (27, 27) the covariance that errors gain in a second, Ad_X Q Ad_X^T.

    The accelerometer's noise is the same in all directions, and the contacts' noise is in the
    floor's frame, so only the gyroscope's noise is rotated. ``standing`` (4,) of bool says which
    contacts stand; other contacts have no errors.
    """
    turning = group.turning(belief.pose)
    found, n = np.zeros((N_ERRORS, N_ERRORS)), GYROSCOPE_BIAS.start
    found[:n, :n] = noise.gyroscope**2 * (turning @ turning.T)
    slipping = noise.slip**2, noise.slip**2, noise.sinking**2
    diagonal = np.zeros(N_ERRORS)
    diagonal[errors_of(VELOCITY)] = noise.accelerometer**2
    diagonal[errors_of(FIRST_CONTACT).start : n] = np.outer(standing, slipping).ravel()
    diagonal[GYROSCOPE_BIAS] = noise.gyroscope_walk**2
    diagonal[ACCELEROMETER_BIAS] = noise.accelerometer_walk**2
    # Every (N + 1)-th entry of the flat array is on the diagonal.
    found.flat[:: N_ERRORS + 1] += diagonal
    return found


def moved(pose: Pose, omega: np.ndarray, force: np.ndarray, dt_s: float) -> Pose:
    """Return a pose after dt at the body's constant angular velocity (3,) and specific force (3,).

    R <- R Gamma_0(w dt),    v <- v + (R Gamma_1(w dt) a + g) dt
    p <- p + v dt + (R Gamma_2(w dt) a + g / 2) dt^2
    """
    rotation, vectors = pose.rotation, pose.vectors.copy()
    gamma_0, gamma_1, gamma_2 = group.gammas(omega * dt_s)
    velocity = pose.vectors[VELOCITY]
    # The place first: it takes the velocity from before the step.
    vectors[PLACE] += velocity * dt_s + (rotation @ gamma_2 @ force + FREE_FALL_M_S2 / 2) * dt_s**2
    vectors[VELOCITY] += (rotation @ gamma_1 @ force + FREE_FALL_M_S2) * dt_s
    return Pose(rotation @ gamma_0, vectors)


def propagated(
    belief: Belief,
    gyroscope: np.ndarray,
    accelerometer: np.ndarray,
    standing: np.ndarray,
    dt_s: float,
    noise: ImuNoise,
) -> Belief:
    """Return the belief after dt, by the IMU's values (3,) during that time.

    P <- Phi (P + growth dt) Phi^T; see `growth` for ``standing``.
    """
    phi = transition(belief, dt_s)
    covariance = belief.covariance + growth(belief, standing, noise) * dt_s
    pose = moved(
        belief.pose,
        gyroscope - belief.gyroscope_bias,
        accelerometer - belief.accelerometer_bias,
        dt_s,
    )
    return belief._replace(pose=pose, covariance=phi @ covariance @ phi.T)
