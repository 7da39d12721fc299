"""Decoded connections as matrices: W = E T D from neuron to neuron."""

import functools
from dataclasses import dataclass

import nengo
import numpy as np
import scipy.sparse as sparse

from spikeport.arrays import number_alike
from spikeport.compile.ground.scope import target_rows
from spikeport.compile.loihi.solver import ParameterSolver, is_sparse


@dataclass(frozen=True)
class Link:
    """A decoded connection as matrices.

    Attributes
    ----------
    decoders : (d, n_pre) array
        Decoders of values in units of the target's radius.
    encoders : (n_post, d) array
        Encoders of the target.
    gains : (n_post,) array
        Gains of the target.
    """

    decoders: sparse.csr_array
    encoders: sparse.csr_array
    gains: np.ndarray

    @functools.cached_property
    def _columns(self) -> tuple[sparse.csc_array, np.ndarray]:
        """The distinct columns of the decoders (d, n), and the column of each neuron, (n_pre,)."""
        columns = sparse.csc_array(self.decoders)
        of = number_columns(columns)
        return columns[:, np.unique(of, return_index=True)[1]], of

    @functools.cached_property
    def axons(self) -> sparse.csc_array:
        """The decoders (d, n) of each axon: neurons whose decoders are equal share one."""
        columns, _ = self._columns
        return columns[:, np.diff(columns.indptr) > 0]

    @functools.cached_property
    def distinct_weights(self) -> sparse.csr_array:
        """The distinct columns of the weights W = E T D from neuron to neuron, (n_post, n)."""
        return sparse.csr_array(self.encoders @ self._columns[0])

    @property
    def transform(self) -> np.ndarray | nengo.Sparse:
        """The weights (n_post, n_pre) from neuron to neuron, as a Nengo transform."""
        distinct, columns = self.distinct_weights, self._columns[1]
        shape = distinct.shape[0], len(columns)
        if is_sparse(self.n_weights, shape):
            return nengo.Sparse(shape, init=sparse.csr_matrix(distinct[:, columns]))
        # Columns of a dense matrix are taken sooner than those of a sparse one.
        return np.take(distinct.toarray(), columns, axis=1)

    @property
    def n_weights(self) -> int:
        """The number of weights from neuron to neuron that are not zero."""
        distinct = self.distinct_weights
        columns = np.bincount(distinct.indices, minlength=distinct.shape[1])
        return int(columns[self._columns[1]].sum())


def number_columns(matrix: sparse.csc_array) -> np.ndarray:
    """Number the columns of a matrix; equal columns get equal numbers."""
    return number_alike(np.rec.fromarrays([matrix.indices, matrix.data]), matrix.indptr)


def link(connection: nengo.Connection, solver: ParameterSolver) -> Link:
    """Solve the decoders of a connection, and the encoders of its target.

    Raises
    ------
    RefusedError
        If nengo-loihi's builder refuses the connection or one of its ends.
    """
    post = connection.post_obj
    weights = sparse.coo_array(solver.weights(connection) / post.radius)
    rows = target_rows(connection)[weights.row]
    shape = (post.size_in, weights.shape[1])
    decoders = sparse.coo_array((weights.data, (rows, weights.col)), shape=shape)
    built = solver.ensemble(post)
    return Link(sparse.csr_array(decoders), sparse.csr_array(built.encoders), gains=built.gain)
