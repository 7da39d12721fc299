"""Transforms of connections as matrices, also placed within the matrices of whole objects."""

from typing import TypeAlias

import numpy as np
import scipy.sparse as sparse

Matrix: TypeAlias = np.ndarray | sparse.csr_array


def transformed(transform: Matrix, matrix: Matrix) -> Matrix:
    """Apply a transform, which is a factor, factors (rows,) or a matrix, to a matrix."""
    if transform.ndim == 2:
        return transform @ matrix
    factors = np.reshape(transform, (-1, 1))
    if isinstance(matrix, np.ndarray):
        return factors * matrix
    return sparse.csr_array(matrix.multiply(factors))


def full(transform: Matrix, size: int) -> np.ndarray:
    """Return a transform of vectors (size,) as a dense matrix."""
    dense = transform if isinstance(transform, np.ndarray) else transform.toarray()
    matrix: np.ndarray = dense if dense.ndim == 2 else transformed(dense, np.eye(size))
    return matrix


def placed(matrix: np.ndarray, rows: np.ndarray, size: int) -> np.ndarray:
    """Place the rows of a matrix (n, columns) at n rows of a matrix of zeros, (size, columns).

    Rows with the same place add up, as in Nengo if a slice has an entry twice.
    """
    whole = np.zeros((size, matrix.shape[1]))
    # An assignment would keep only the last of these.
    np.add.at(whole, rows, matrix)
    return whole
