"""Gains, encoders and weights as nengo-loihi would build them, before there are any blocks.

nengo-loihi solves decoders for the chip's own firing rates, and limits intercepts. The passes that
rewrite a network with explicit matrices take these from here, from its very builder.
"""

import collections
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import scipy.sparse as sparse
from nengo.builder.connection import BuiltConnection
from nengo.builder.ensemble import BuiltEnsemble
from nengo_loihi.builder import Model
from nengo_loihi.builder.ensemble import build_ensemble
from nengo_loihi.compat import sample_transform

from spikeport.compile.numpy1 import numpy1_semantics
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.verdict.finite import not_finite, refused_or_not_finite

DENSE_FROM = 0.5
"""Share of non-zero weights from which indices cost more than zeros."""
Matrix = Any
"""A NumPy array or a sparse one."""


class Solved:
    """Builds ensembles and weights of a network's connections, each when it is first asked for.

    Parameters
    ----------
    rewrite : Rewrite
        The network and the seeds of its objects.
    dt_s : float
        The time step, in seconds.
    """

    def __init__(self, rewrite: Rewrite, dt_s: float) -> None:
        self._names = rewrite.names
        self._model = Model(dt=dt_s)
        self.seeds = rewrite.all_seeds()
        self._model.seeds = self.seeds
        scratch = nengo.Network()
        nengo_loihi.add_params(scratch)
        self._model.config = scratch.config

    def ensemble(self, ensemble: nengo.Ensemble) -> BuiltEnsemble:
        """Gain, bias and encoders; the radius is not part of the encoders."""
        if ensemble not in self._model.params:
            self._guarded(ensemble, self._build, ensemble)
        return self._model.params[ensemble]

    def initial_state(self, ensemble: nengo.Ensemble) -> dict[str, np.ndarray]:
        """Where float Nengo's neurons start; on the chip they start at zero."""
        rng = np.random.RandomState(self.seeds[ensemble] + 1)
        return ensemble.neuron_type.make_state(ensemble.n_neurons, rng=rng)

    def transform(self, connection: nengo.Connection) -> np.ndarray:
        """The transform of a connection: a factor, a factor for each row, or a matrix."""
        return sample_transform(connection, self._rng(connection))

    def weights(self, connection: nengo.Connection) -> np.ndarray:
        """(size_out, n) from what the whole of ``pre_obj`` puts out: neurons, or a node's values.

        .. math:: W = T D

        with decoders D where ``pre_obj`` is an ensemble, and a selection where it is sliced.
        """
        pre = connection.pre_obj
        if isinstance(pre, nengo.Ensemble):
            return self.decoded(connection).weights
        whole = np.zeros((pre.size_out, connection.size_out))
        picked = np.arange(pre.size_out)[connection.pre_slice]
        np.add.at(whole, picked, full(self.transform(connection), connection.size_mid).T)
        return whole.T

    def decoded(self, connection: nengo.Connection) -> BuiltConnection:
        """What is built of a connection from an ensemble, in Nengo's units."""
        if connection not in self._model.params:
            self.ensemble(connection.pre_obj)
            built = self._guarded(connection, self._decode, connection)
            if not np.isfinite(built.weights).all():
                raise not_finite(self._names[connection], "decoders or transform")
            self._model.params[connection] = built
        return self._model.params[connection]

    def built(self, connection: nengo.Connection) -> BuiltConnection:
        """What is built of any connection, in Nengo's units."""
        if isinstance(connection.pre_obj, nengo.Ensemble):
            return self.decoded(connection)
        transform = self.transform(connection)
        return BuiltConnection(None, None, weights=transform, transform=transform)

    def _build(self, ensemble: nengo.Ensemble) -> None:
        build_ensemble(self._model, ensemble)

    def _decode(self, connection: nengo.Connection) -> BuiltConnection:
        rng = self._rng(connection)
        transform = sample_transform(connection, rng)
        points, decoders, info = self._model.build(connection.solver, connection, rng, transform)
        weights = transformed(transform, decoders)
        return BuiltConnection(points, info, weights=weights, transform=transform)

    def _rng(self, connection: nengo.Connection) -> np.random.RandomState:
        return np.random.RandomState(self.seeds[connection])

    def _guarded(self, obj: Any, build: Any, *args: Any) -> Any:
        with numpy1_semantics():
            try:
                return build(*args)
            except Exception as error:  # it refuses by errors of any kind, not only by its own
                raise refused_or_not_finite(self._names[obj], error) from error


class FloatSolved(Solved):
    """The same, as Nengo builds them: decoders are solved for the rates of float neurons."""

    def __init__(self, rewrite: Rewrite, dt_s: float) -> None:
        super().__init__(rewrite, dt_s)
        self._model = nengo.builder.Model(dt=dt_s)
        self._model.seeds = self.seeds
        self._model.seeded = collections.defaultdict(bool)

    def _build(self, ensemble: nengo.Ensemble) -> None:
        self._model.build(ensemble)

    def _decode(self, connection: nengo.Connection) -> BuiltConnection:
        rng = self._rng(connection)
        points, decoders, info = self._model.build(connection.solver, connection, rng)
        transform = self.transform(connection)
        weights = transformed(transform, decoders)
        return BuiltConnection(points, info, weights=weights, transform=transform)


def transformed(transform: np.ndarray, matrix: Matrix) -> Matrix:
    """A transform, given as factor, factors or matrix, applied to a matrix."""
    if transform.ndim == 2:
        return transform @ matrix
    if sparse.issparse(matrix):
        return sparse.csr_array(matrix.multiply(np.reshape(transform, (-1, 1))))
    return np.reshape(transform, (-1, 1)) * matrix


def full(transform: Matrix, size: int) -> np.ndarray:
    """A transform of vectors of some size as a matrix."""
    if sparse.issparse(transform):
        return transform.toarray()
    return transform if transform.ndim == 2 else transformed(transform, np.eye(size))


def transform_of(matrix: sparse.csr_array) -> Any:
    """A Nengo transform: without the zeros, where indices cost less than these."""
    if matrix.nnz > DENSE_FROM * np.prod(matrix.shape):
        return matrix.toarray()
    return nengo.Sparse(matrix.shape, init=sparse.csr_matrix(matrix))
