"""Decoders that neurons share, in place of one for each neuron.

Neurons with equal decoders have equal weights wherever they are wired to, so their spikes can share
an input axon and its synapses: a connection from neurons with k different decoders stores k rows.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import nengo
import numpy as np
from nengo.params import NdarrayParam
from nengo.solvers import NoSolver, Solver, SolverParam

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.colouring import alike, regroupable
from spikeport.compile.rewriting.flat_network import DECODING, FlatNetwork
from spikeport.compile.rewriting.passthrough import foldable


class DecodingError(NamedTuple):
    """The error of decoded values, as sums of squares over evaluation points.

    Attributes
    ----------
    values : float
        The sum for the values that are to be decoded.
    own, shared : float
        The sums for the errors of each neuron's own decoders, and of shared decoders.
    """

    values: float
    own: float
    shared: float

    @property
    def before(self) -> float:
        """The relative rms error of each neuron's own decoders."""
        return _relative(self.own, self.values)

    @property
    def after(self) -> float:
        """The relative rms error of shared decoders."""
        return _relative(self.shared, self.values)

    @property
    def added(self) -> float:
        """The rise of the relative rms error if decoders are shared."""
        return self.after - self.before


class Shared(NamedTuple):
    """A connection, the decoders (n, d) that its neurons could share, and their error."""

    connection: nengo.Connection
    decoders: np.ndarray
    error: DecodingError


def shareable(rewrite: Rewrite, solver: ParameterSolver) -> list[list[Shared]]:
    """Return the decoders that neurons could share, by groups of ensembles that may be fused.

    Neurons with equal encoders can share: in a one-dimensional ensemble, neurons of equal sign. A
    connection is left out if it would not have fewer decoders, if it learns or solves for weights,
    or if the user set its decoders.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    solver : ParameterSolver
        Solves its decoders.

    Raises
    ------
    RefusedError
        If the builder refuses an ensemble or a connection.
    """
    scope = rewrite.scope
    free = regroupable(scope, foldable(scope))
    decoded = defaultdict(list)
    for connection in filter(_is_solved, rewrite.network.all_connections):
        decoded[connection.pre_obj].append(connection)
    groups = (
        [one for ensemble in group for c in decoded[ensemble] for one in _shared(c, solver)]
        for group in alike(scope, free)
    )
    return [group for group in groups if group]


def tied(rewrite: Rewrite, chosen: Iterable[Shared], solver: ParameterSolver) -> Rewrite:
    """Return a network in which the neurons before some connections share decoders.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    chosen : iterable of Shared
        The connections to change, and their decoders.
    solver : ParameterSolver
        The solver of these decoders.
    """
    new = {one.connection: _twin(one.connection, NoSolver(one.decoders), solver) for one in chosen}

    def connect(old: nengo.Connection, flat: FlatNetwork) -> None:
        flat.keep(new.get(old, old))
        if old in new:
            flat.configure(new[old], old)

    flat = FlatNetwork.rewired(rewrite.network, solver.seeds, connect)
    built = {old: solver.built(twin) for old, twin in new.items()}
    return rewrite.then(flat.network, flat.seeds, built=built)


def pooled(errors: Iterable[DecodingError]) -> DecodingError:
    """Return the error of several connections taken together."""
    return DecodingError(*(sum(squares) for squares in zip(*errors, strict=True)))


class _OnePerClass(Solver):
    r"""One decoder for all neurons of a class: least squares with one unknown for each class.

    .. math:: D = C X, \quad X = \arg\min_X \|A C X - Y\|^2

    with rates A (m, n), values Y (m, d) and classes C (n, k): 1 where a neuron is in a class.
    """

    classes = NdarrayParam("classes", shape=("*", "*"))
    own = SolverParam("own")

    def __init__(self, classes: np.ndarray, own: Solver) -> None:
        super().__init__(weights=False)
        self.classes = classes
        self.own = own

    def __call__(
        self, A: np.ndarray, Y: np.ndarray, rng: object = np.random
    ) -> tuple[np.ndarray, dict[str, object]]:
        """Return shared decoders (n, d), and how they compare with the neurons' own."""
        shared = self.classes @ np.linalg.lstsq(A @ self.classes, Y, rcond=None)[0]
        own, _ = self.own(A, Y, rng=rng)
        sums = [float(np.square(values).sum()) for values in (Y, A @ own - Y, A @ shared - Y)]
        fewer = len(np.unique(shared, axis=0)) < len(np.unique(own, axis=0))
        return shared, {"decoders": shared, "error": DecodingError(*sums), "fewer": fewer}


def _is_solved(connection: nengo.Connection) -> bool:
    """Return whether a solver finds decoders for a connection, which does not learn."""
    return (
        isinstance(connection.pre_obj, nengo.Ensemble)
        and connection.learning_rule_type is None
        and not connection.solver.weights
        and not isinstance(connection.solver, NoSolver)
    )


def _shared(connection: nengo.Connection, solver: ParameterSolver) -> Iterator[Shared]:
    """Yield the decoders that the neurons before a connection could share, if they are fewer."""
    encoders = solver.ensemble(connection.pre_obj).encoders
    _, number = np.unique(encoders, axis=0, return_inverse=True)
    # Each neuron has a row of the identity matrix, that of its class.
    classes = np.eye(number.max() + 1)[number.ravel()]
    # Every neuron is a class of its own: there is nothing to share.
    if classes.shape[1] == len(encoders):
        return
    twin = _twin(connection, _OnePerClass(classes, connection.solver), solver)
    found: Mapping[str, Any] = solver.decoded(twin).solver_info
    if found["fewer"]:
        yield Shared(connection, found["decoders"], found["error"])


def _twin(connection: nengo.Connection, by: Solver, solver: ParameterSolver) -> nengo.Connection:
    """Return a connection like another, in no network, with decoders of another solver."""
    like = {name: getattr(connection, name) for name in (*DECODING, "synapse", "transform")}
    twin = nengo.Connection(
        connection.pre, connection.post, **{**like, "solver": by}, add_to_container=False
    )
    # The same seed draws the same evaluation points, so errors differ by the decoders alone.
    solver.seeds[twin] = solver.seeds[connection]
    return twin


def _relative(error: float, values: float) -> float:
    # Values that are zero throughout are decoded without an error.
    return float(np.sqrt(error / values)) if values else 0.0
