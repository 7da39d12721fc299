import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm

from spikeport.robot.estimator import group
from spikeport.robot.estimator.group import SMALL_RAD, Pose
from tests.helpers.lie_group import adjoint, inverse, log

VECTOR = arrays(float, 3, elements=st.floats(-1.5, 1.5, width=32))
N = 3
COORDINATES = arrays(float, 3 + 3 * N, elements=st.floats(-1.5, 1.5, width=32))


def as_matrix(pose: Pose) -> np.ndarray:
    """Return the matrix [R, x_1 ... x_n; 0, I]."""
    n = len(pose.vectors)
    return np.block([[pose.rotation, pose.vectors.T], [np.zeros((n, 3)), np.eye(n)]])


def as_algebra(xi: np.ndarray) -> np.ndarray:
    """Return the matrix [hat(phi), rho_1 ... rho_n; 0, 0]."""
    rho = xi[3:].reshape(-1, 3)
    n = len(rho)
    return np.block([[group.hat(xi[:3]), rho.T], [np.zeros((n, 3 + n))]])


@given(VECTOR, VECTOR)
def test_hat_is_the_cross_product(a, b):
    np.testing.assert_allclose(group.hat(a) @ b, np.cross(a, b), atol=1e-12)


@given(COORDINATES)
def test_hats_of_many_vectors_equal_those_of_each_vector(xi):
    vectors = xi.reshape(-1, 3)
    np.testing.assert_array_equal(group.hats(vectors), [group.hat(v) for v in vectors])


@pytest.mark.slow
@given(COORDINATES)
def test_exp_is_the_matrix_exponential(xi):
    np.testing.assert_allclose(as_matrix(group.exp(xi)), expm(as_algebra(xi)), atol=1e-9)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-6, 0.99e-4, 1.01e-4, 1e-3, 3.0])
def test_gammas_are_their_series_at_every_angle(size):
    phi = size * np.array([0.6, -0.8, 0.0])
    cross, found = group.hat(phi), group.gammas(phi)
    for m in range(3):
        term = np.eye(3) / [1, 1, 2][m]
        series = term.copy()
        for n in range(1, 40):
            term = term @ cross / (n + m)
            series += term
        np.testing.assert_allclose(found[m], series, atol=1e-15 if size < SMALL_RAD else 2e-9)


@given(COORDINATES)
def test_log_is_the_inverse_of_exp(xi):
    np.testing.assert_allclose(log(group.exp(xi)), xi, atol=1e-6)


@given(COORDINATES, COORDINATES)
def test_products_and_inverses_are_those_of_matrices(xi, other):
    x, y = group.exp(xi), group.exp(other)
    found = as_matrix(group.multiply(x, y))
    np.testing.assert_allclose(found, as_matrix(x) @ as_matrix(y), atol=1e-9)
    one = as_matrix(group.multiply(x, inverse(x)))
    np.testing.assert_allclose(one, np.eye(3 + N), atol=1e-9)


@given(COORDINATES, COORDINATES)
def test_the_adjoint_moves_an_error_from_the_right_to_the_left(xi, other):
    x = group.exp(xi)
    right = group.multiply(x, group.exp(0.5 * other))
    left = group.multiply(group.exp(0.5 * adjoint(x) @ other), x)
    np.testing.assert_allclose(as_matrix(left), as_matrix(right), atol=1e-8)


@given(COORDINATES)
def test_rotations_stay_rotations(xi):
    rotation = group.exp(xi).rotation
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
