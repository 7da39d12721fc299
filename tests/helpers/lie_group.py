"""Functions of SE_n(3) that only tests of a filter need, and not the filter; see `group`."""

import numpy as np

from spikeport.robot.estimator.group import SMALL_RAD, Pose, gammas, turning


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Return the logarithm (3,) in rad of a rotation (3, 3) by less than pi."""
    skew = np.array([rotation[2, 1], rotation[0, 2], rotation[1, 0]])
    sine = (skew - np.array([rotation[1, 2], rotation[2, 0], rotation[0, 1]])) / 2
    size = float(np.sqrt(sine @ sine))
    # arctan2 is exact at small and large angles, where arcsin or arccos would lose digits.
    theta = float(np.arctan2(size, (np.trace(rotation) - 1) / 2))
    return np.asarray(sine if size < SMALL_RAD else sine * (theta / size))


def log(pose: Pose) -> np.ndarray:
    """Return the coordinates (3 + 3 n,) of an element: the inverse of `group.exp`."""
    phi = rotation_vector(pose.rotation)
    # Gamma_1 is singular only at multiples of 2 pi.
    rho = np.linalg.solve(gammas(phi)[1], pose.vectors.T).T
    return np.concatenate((phi, rho.ravel()))


def inverse(pose: Pose) -> Pose:
    """Return the inverse of an element."""
    return Pose(pose.rotation.T, -pose.vectors @ pose.rotation)


def adjoint(pose: Pose) -> np.ndarray:
    """Return Ad_X (3 + 3 n, 3 + 3 n): X exp(xi) = exp(Ad_X xi) X.

    It has R on the diagonal, and `group.turning` as its first columns.
    """
    matrix = np.kron(np.eye(len(pose.vectors) + 1), pose.rotation)
    matrix[:, :3] = turning(pose)
    return matrix
