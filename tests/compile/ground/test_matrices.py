"""Transforms as matrices, and their places in the matrices of whole objects."""

import numpy as np
import pytest
import scipy.sparse as sparse

from spikeport.compile.ground.matrices import Matrix, full, placed, transformed

DENSE = np.array([[1.0, 2.0], [0.0, 3.0]])


@pytest.mark.parametrize(
    ("transform", "matrix"),
    [
        (np.array(2.0), 2 * np.eye(2)),
        (np.array([2.0, 3.0]), np.diag([2.0, 3.0])),
        (DENSE, DENSE),
        (sparse.csr_array(DENSE), DENSE),
    ],
)
def test_every_kind_of_transform_becomes_a_dense_matrix(
    transform: Matrix, matrix: np.ndarray
) -> None:
    np.testing.assert_array_equal(full(transform, 2), matrix)


def test_factors_leave_a_sparse_matrix_sparse() -> None:
    scaled = transformed(np.array([2.0, 3.0]), sparse.csr_array(DENSE))
    assert isinstance(scaled, sparse.csr_array)
    np.testing.assert_array_equal(scaled.toarray(), [[2, 4], [0, 9]])


def test_rows_with_the_same_place_add_up() -> None:
    found = placed(DENSE, np.array([2, 2]), 3)
    np.testing.assert_array_equal(found, [[0, 0], [0, 0], [1, 5]])
