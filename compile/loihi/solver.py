"""Gains, encoders and decoders of a builder, before there are any blocks.

nengo-loihi solves decoders for the chip's own firing rates, and limits intercepts. The passes that
rewrite a network with explicit matrices get these parameters here, from nengo-loihi's own builder.
"""

import collections
import copy
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias, TypeVar

import nengo
import nengo_loihi
import numpy as np
import scipy.sparse as sparse
from nengo.base import NengoObject
from nengo.builder.connection import BuiltConnection
from nengo.builder.ensemble import BuiltEnsemble
from nengo_loihi.block import Compartment
from nengo_loihi.builder import Model
from nengo_loihi.builder.ensemble import build_ensemble
from nengo_loihi.compat import sample_transform

from spikeport.compile.check.finite import not_finite, refused_or_not_finite
from spikeport.compile.ground.matrices import Matrix, full, placed, transformed
from spikeport.compile.ground.notices import warnings_about
from spikeport.compile.ground.rewrite import Rewrite, Seeds
from spikeport.compile.ground.scope import is_called, source_rows
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.quick_builder import quick_builder, random_state

DENSE_FROM = 0.5
"""Share of non-zero weights above which their indices cost more than the zeros between them."""
AnyModel: TypeAlias = Model | nengo.builder.Model
Result = TypeVar("Result")


class Builder(NamedTuple):
    """A builder of ensembles and of decoded connections.

    Attributes
    ----------
    new_model : callable
        Returns the model to build into, for a time step in seconds and the seeds of all objects.
    build_ensemble : callable
        Adds a `BuiltEnsemble` to a model.
    build_decoders : callable
        Returns a `BuiltConnection` of a connection from an ensemble that a model has.
    """

    new_model: Callable[[float, Seeds], AnyModel]
    build_ensemble: Callable[[AnyModel, nengo.Ensemble], object]
    build_decoders: Callable[[AnyModel, nengo.Connection], BuiltConnection]


class ParameterSolver:
    """A solver of a network's ensembles and connections, each solved on first use.

    Parameters
    ----------
    rewrite : Rewrite
        The network and the seeds of its objects.
    dt_s : float
        The time step, in seconds.
    builder : Builder, optional
        By default `CHIP`, nengo-loihi's.
    built : mapping of nengo.Ensemble to BuiltEnsemble, optional
        Ensembles that are built already.

    Attributes
    ----------
    dt_s : float
        The time step, in seconds.
    seeds : dict of Nengo objects to int
        The seeds; an object that is not part of the network needs an entry before it is built.
    """

    def __init__(
        self,
        rewrite: Rewrite,
        dt_s: float,
        builder: Builder | None = None,
        built: Mapping[nengo.Ensemble, BuiltEnsemble] | None = None,
    ) -> None:
        self.dt_s, self._names = dt_s, rewrite.names
        self._builder = builder or CHIP
        self.seeds = rewrite.all_seeds()
        self._model = self._builder.new_model(dt_s, self.seeds)
        self._model.params.update(built or {})

    def ensemble(self, ensemble: nengo.Ensemble) -> BuiltEnsemble:
        """Return gain, bias and encoders; the radius is not part of the encoders.

        Raises
        ------
        RefusedError
            If the builder refuses the ensemble.
        """
        if ensemble not in self._model.params:
            self._guarded(self._builder.build_ensemble, ensemble)
        return self._model.params[ensemble]

    def compartment(self, ensemble: nengo.Ensemble) -> Compartment:
        """Return a copy of the compartments of an ensemble on the chip, in floating point."""
        self.ensemble(ensemble)
        return copy.deepcopy(self._model.objs[ensemble]["in"].compartment)

    def initial_state(self, ensemble: nengo.Ensemble) -> dict[str, np.ndarray]:
        """Return the state that float Nengo's neurons start in; on the chip they start at zero."""
        rng = random_state(self.seeds[ensemble] + 1)  # as Nengo's builder seeds it
        state: dict[str, np.ndarray] = ensemble.neuron_type.make_state(ensemble.n_neurons, rng=rng)
        return state

    def transform(self, connection: nengo.Connection) -> Matrix:
        """Return the transform of a connection: a factor, a factor for each row, or a matrix."""
        return _sampled_transform(connection, self.seeds)

    def weights(self, connection: nengo.Connection) -> Matrix:
        """Return the matrix from the whole output of ``pre_obj`` to the connection's values.

        .. math:: W = T D

        where D has the decoders if ``pre_obj`` is an ensemble, else selects the slice.

        Returns
        -------
        weights : (size_out, n) array
            For n neurons, or values of a node; sparse if the transform is.

        Raises
        ------
        RefusedError
            If the builder refuses the connection or its ensemble.
        """
        pre = connection.pre_obj
        if isinstance(pre, nengo.Ensemble):
            weights: Matrix = self.decoded(connection).weights
            return weights
        rows, transform = source_rows(connection), self.transform(connection)
        if sparse.issparse(transform):
            picks = np.ones(len(rows)), (np.arange(len(rows)), rows)
            return sparse.csr_array(transform) @ sparse.csr_array(picks, (len(rows), pre.size_out))
        return placed(full(transform, connection.size_mid).T, rows, pre.size_out).T

    def decoded(self, connection: nengo.Connection) -> BuiltConnection:
        """Return the built parameters of a connection from an ensemble, in Nengo's units.

        Raises
        ------
        RefusedError
            If the builder refuses the connection or its ensemble, or decoders are not finite.
        """
        if connection not in self._model.params:
            self.ensemble(connection.pre_obj)
            built = self._guarded(self._builder.build_decoders, connection)
            if not np.isfinite(built.weights).all():
                raise not_finite(self._names[connection], "decoders or transform")
            self._model.params[connection] = built
        return self._model.params[connection]

    def built(self, connection: nengo.Connection) -> BuiltConnection:
        """Return the built parameters of any connection, in Nengo's units."""
        # A run calls the functions of Direct ensembles, which have no decoders: a call here would
        # change the state that some keep.
        if isinstance(connection.pre_obj, nengo.Ensemble) and not is_called(connection):
            return self.decoded(connection)
        transform = self.transform(connection)
        return BuiltConnection(None, None, weights=transform, transform=transform)

    def _guarded(
        self, build: Callable[[AnyModel, NengoObject], Result], obj: NengoObject
    ) -> Result:
        with numpy1_semantics(), quick_builder(), warnings_about(self._names.known(obj)):
            try:
                return build(self._model, obj)
            except Exception as error:  # the builder refuses by errors of any kind
                raise refused_or_not_finite(self._names.with_ends(obj), error) from error


def _sampled_transform(connection: nengo.Connection, seeds: Seeds) -> Matrix:
    return sample_transform(connection, random_state(seeds[connection]))


def _new_chip_model(dt_s: float, seeds: Seeds) -> Model:
    model = Model(dt=dt_s)
    model.seeds = seeds
    # nengo-loihi looks up settings of every object; these are its defaults.
    scratch = nengo.Network(add_to_container=False)
    nengo_loihi.add_params(scratch)
    model.config = scratch.config
    return model


def _build_chip_decoders(model: Model, connection: nengo.Connection) -> BuiltConnection:
    # The transform comes first, and the solver goes on with the same random generator.
    rng = random_state(model.seeds[connection])
    transform = sample_transform(connection, rng)
    points, decoders, info = model.build(connection.solver, connection, rng, transform)
    weights = transformed(transform, decoders)
    return BuiltConnection(points, info, weights=weights, transform=transform)


CHIP = Builder(_new_chip_model, build_ensemble, _build_chip_decoders)
"""nengo-loihi's builder: decoders are solved for the rates of neurons on the chip."""


def _new_float_model(dt_s: float, seeds: Seeds) -> nengo.builder.Model:
    model = nengo.builder.Model(dt=dt_s)
    model.seeds = seeds
    # Nengo caches decoders of objects that have their own seed. Here no object counts as such.
    model.seeded = collections.defaultdict(bool)
    return model


def _build_float_decoders(
    model: nengo.builder.Model, connection: nengo.Connection
) -> BuiltConnection:
    # Here the solver comes first, and the transform has its own random generator.
    rng = random_state(model.seeds[connection])
    points, decoders, info = model.build(connection.solver, connection, rng)
    transform = _sampled_transform(connection, model.seeds)
    weights = transformed(transform, decoders)
    return BuiltConnection(points, info, weights=weights, transform=transform)


FLOAT = Builder(_new_float_model, nengo.builder.Model.build, _build_float_decoders)
"""Nengo's own builder: decoders are solved for the rates of float neurons."""


def nengo_transform(matrix: sparse.csr_array) -> np.ndarray | nengo.Sparse:
    """Return a matrix as a Nengo transform, a sparse one where indices cost less than zeros."""
    if not is_sparse(matrix.nnz, matrix.shape):
        return matrix.toarray()
    return nengo.Sparse(matrix.shape, init=sparse.csr_matrix(matrix))


def is_sparse(n_entries: int, shape: tuple[int, int]) -> bool:
    """Return whether the indices of a matrix cost less than its zeros."""
    # nengo-loihi has no bits for the indices of a matrix without entries.
    return 0 < n_entries <= DENSE_FROM * shape[0] * shape[1]
