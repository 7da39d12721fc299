"""The matrix Lie groups SO(3) and SE_n(3): a rotation with n vectors that turn with it.

    X = [R, x_1 ... x_n; 0, I],    X Y = (R_x R_y, R_x y_i + x_i)

Coordinates of its Lie algebra are xi = (phi, rho_1, ..., rho_n) in R^(3 + 3 n).

Source: R. Hartley, M. Ghaffari, R. M. Eustice, J. W. Grizzle, "Contact-Aided Invariant Extended
Kalman Filtering for Robot State Estimation", IJRR 39(4), 2020, arXiv:1904.09251, with its appendix
on the group's functions.
"""

from typing import NamedTuple

import numpy as np

SMALL_RAD = 1e-4
"""Angle below which series of two terms replace quotients of small numbers."""

_EYE = np.eye(3)
_LEVI_CIVITA = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)
"""hat(e_x), hat(e_y) and hat(e_z)."""


class Pose(NamedTuple):
    """An element of SE_n(3).

    Attributes
    ----------
    rotation : ndarray, (3, 3)
        R.
    vectors : ndarray, (n, 3)
        x_1 ... x_n.
    """

    rotation: np.ndarray
    vectors: np.ndarray


def hat(vector: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of the cross product with a vector (3,): hat(a) b = a x b."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def hats(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) of the cross products with vectors (n, 3)."""
    return np.tensordot(vectors, _LEVI_CIVITA, 1)


def gammas(phi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Gamma_0, Gamma_1 and Gamma_2 (3, 3) of a rotation vector (3,) in rad.

    Gamma_m(phi) = sum over n of hat(phi)^n / (n + m)!: Gamma_0 is the exponential of SO(3), Gamma_1
    its left Jacobian. Source: the paper, on discretisation.
    """
    theta = float(np.sqrt(phi @ phi))
    square = theta * theta
    # Differences of nearly equal numbers lose digits: just above the limit, the entries of Gamma_2
    # are off by up to 5e-9. Below it, the next terms of the series are less than 1e-16.
    if theta < SMALL_RAD:
        a, b = 1 - square / 6, 0.5 - square / 24
        c, d = 1 / 6 - square / 120, 1 / 24 - square / 720
    else:
        a, b = np.sin(theta) / theta, (1 - np.cos(theta)) / square
        c, d = (1 - a) / square, (0.5 - b) / square
    cross = hat(phi)
    twice, eye = cross @ cross, _EYE
    return eye + a * cross + b * twice, eye + b * cross + c * twice, eye / 2 + c * cross + d * twice


def exp(xi: np.ndarray) -> Pose:
    """Return the exponential of coordinates (3 + 3 n,).

    R = Gamma_0(phi), x_i = Gamma_1(phi) rho_i.
    """
    gamma_0, gamma_1, _ = gammas(xi[:3])
    return Pose(gamma_0, xi[3:].reshape(-1, 3) @ gamma_1.T)


def multiply(left: Pose, right: Pose) -> Pose:
    """Return the product of two elements."""
    turned = right.vectors @ left.rotation.T
    return Pose(left.rotation @ right.rotation, turned + left.vectors)


def turning(pose: Pose) -> np.ndarray:
    """Return the columns of Ad_X for rotations, (3 + 3 n, 3): R above all hat(x_i) R."""
    below = hats(pose.vectors) @ pose.rotation
    return np.concatenate((pose.rotation, below.reshape(-1, 3)))
