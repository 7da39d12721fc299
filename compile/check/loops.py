"""Loops that keep the errors that the chip makes: rule SP413.

A decoded connection is close to linear over its evaluation points, y = T f(x) = M x + m. In a loop
of such connections, each through a filter of time constant tau,

    tau dx/dt = (M - 1) x + input

so that an error decays with time constant tau / (1 - g), where the gain g is the largest real part
among the eigenvalues of M. The error stays if g is 1, as in memories and oscillators, and grows if
g is above 1.
Source: Eliasmith and Anderson, Neural Engineering (2003), chapter 8.
"""

from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence
from typing import NamedTuple, TypeAlias, TypeVar

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.builder.connection import get_targets
from nengo.dists import Distribution

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.matrices import Matrix, full, placed
from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import (
    MATRICES,
    Scope,
    is_called,
    is_passthrough,
    source_rows,
    target_rows,
)

KEPT = 0.95
"""Gain of a loop from which on an error lasts twenty time constants of the loop or more."""
LATE = 0.05
"""Share of a loop's time constant that the chip may add to it without a hint."""
MOST_DENSE = 50
"""The most values of a loop for which all eigenvalues are computed."""
Thing = TypeVar("Thing", bound=Hashable)
Part: TypeAlias = nengo.Ensemble | nengo.Node


class Edge(NamedTuple):
    """A connection of a loop, and its matrix from all values of one part to those of the next."""

    pre: Part
    post: Part
    matrix: sparse.csr_array


def loop_hints(scope: Scope) -> Iterator[Violation]:
    """Yield a hint on each loop through the chip in which an error stays or grows."""
    for within in loops([c for c in scope.network.all_connections if _is_decoded(c)]):
        ensembles = {c.pre_obj: None for c in within if isinstance(c.pre_obj, nengo.Ensemble)}
        if any(map(scope.on_chip, ensembles)):
            gain, where = _gain(list(ensembles), _edges(within))
            if gain >= KEPT:
                yield rules.get("SP413").broken(scope.names[where], f"gain {gain:.2g}")


def loops(connections: Sequence[nengo.Connection]) -> list[list[nengo.Connection]]:
    """Find the loops of ensembles and nodes, and return the connections within each."""
    ends = [(base(c.pre_obj), base(c.post_obj)) for c in connections]
    number = components(ends)
    within: dict[int, list[nengo.Connection]] = defaultdict(list)
    for connection, (pre, post) in zip(connections, ends, strict=True):
        if number[pre] == number[post]:
            within[number[pre]].append(connection)
    return list(within.values())


def components(pairs: Sequence[tuple[Thing, Thing]]) -> dict[Thing, int]:
    """Return a number for each end of directed pairs, which is equal for ends in the same loop."""
    number = {end: i for i, end in enumerate(dict.fromkeys(end for pair in pairs for end in pair))}
    rows, columns = np.array([[number[a], number[b]] for a, b in pairs]).reshape(-1, 2).T
    graph = sparse.coo_array((np.ones(len(pairs)), (rows, columns)), shape=(len(number),) * 2)
    if not number:
        return {}
    # The attribute of `sparse` imports SciPy's graphs only here, since that takes 0.2 s.
    _, loop = sparse.csgraph.connected_components(graph, connection="strong")
    return dict(zip(number, map(int, loop), strict=True))


def _is_decoded(connection: nengo.Connection) -> bool:
    """Return whether a connection is a fixed function of values, from one ensemble to another.

    Passthrough nodes may lie in between. Other nodes may not: their functions are not known here.
    """
    transform = connection.transform
    return (
        all(_passes_values(end) for end in (connection.pre_obj, connection.post_obj))
        and connection.learning_rule_type is None
        and (connection.function is None or _is_solved(connection))
        and isinstance(transform, MATRICES)
        and not isinstance(getattr(transform, "init", None), Distribution)
    )


def _is_solved(connection: nengo.Connection) -> bool:
    """Return whether decoders approximate a connection's function; a run then never calls it."""
    return isinstance(connection.pre_obj, nengo.Ensemble) and not is_called(connection)


def _passes_values(obj: object) -> bool:
    return isinstance(obj, nengo.Ensemble) or is_passthrough(obj)


def _edges(connections: Sequence[nengo.Connection]) -> list[Edge]:
    """Return the matrices of connections; users' functions leave NumPy's random state unchanged."""
    state = np.random.get_state()
    try:
        with np.errstate(all="ignore"):
            return [Edge(c.pre_obj, c.post_obj, _matrix(c)) for c in connections]
    finally:
        np.random.set_state(state)


def _matrix(connection: nengo.Connection) -> sparse.csr_array:
    pre, post = connection.pre_obj, connection.post_obj
    matrix = full(_sampled(connection.transform), connection.size_mid) @ _slope(connection)
    columns = placed(matrix.T, source_rows(connection), pre.size_out)
    return sparse.csr_array(placed(columns.T, target_rows(connection), post.size_in))


def _sampled(transform: nengo.transforms.Transform) -> Matrix:
    """Return a transform: a factor, a factor for each row, or a matrix."""
    if isinstance(transform, nengo.transforms.NoTransform):
        return np.array(1.0)
    found: Matrix = transform.sample(np.random.RandomState(0))  # no distribution: any seed does
    return found


def _slope(connection: nengo.Connection) -> np.ndarray:
    """Return the matrix (size_mid, n) closest to a connection's function of n values."""
    size = len(source_rows(connection))
    if connection.function is None:
        return np.eye(size)
    points = _points(connection)
    try:
        values = get_targets(connection, points)
    except Exception:  # a function may raise anything at points other than its own
        values = np.full((len(points), connection.size_mid), np.nan)
    if not np.isfinite(values).all():
        return np.zeros((connection.size_mid, size))
    with_constant = np.hstack([points[:, connection.pre_slice], np.ones((len(points), 1))])
    slope: np.ndarray = np.linalg.lstsq(with_constant, values, rcond=None)[0][:size].T
    return slope


def _points(connection: nengo.Connection) -> np.ndarray:
    """Return evaluation points of a connection, (n_points, dimensions); few if they are random."""
    ensemble = connection.pre_obj
    points = connection.eval_points
    if points is None:
        points = ensemble.eval_points
    if isinstance(points, Distribution):
        n_points = 30 + 3 * ensemble.dimensions
        # Few points are enough for a slope, and large networks have many connections.
        points = points.sample(n_points, ensemble.dimensions, rng=np.random.RandomState(0))
    if connection.eval_points is None or connection.scale_eval_points:
        points = points * ensemble.radius
    found: np.ndarray = points
    return found


def _gain(
    ensembles: Sequence[nengo.Ensemble], edges: Sequence[Edge]
) -> tuple[float, nengo.Ensemble]:
    """Return the gain of a loop, and the ensemble that holds most of a lasting error."""
    sizes = np.cumsum([one.dimensions for one in ensembles])
    nodes = {edge.pre: None for edge in edges if isinstance(edge.pre, nengo.Node)}
    whole = _assembled([*ensembles, *nodes], edges)
    gain, vector = _largest(_past_nodes(whole, sizes[-1], len(nodes)))
    return gain, ensembles[int(np.searchsorted(sizes, np.abs(vector).argmax(), side="right"))]


def _assembled(parts: Sequence[Part], edges: Sequence[Edge]) -> sparse.csr_array:
    """Return the matrix between the values of all parts of a loop, one part after the other."""
    ends = np.cumsum([0, *(one.size_out for one in parts)])
    start = dict(zip(parts, ends[:-1], strict=True))
    blocks = [(edge.matrix.tocoo(), start[edge.post], start[edge.pre]) for edge in edges]
    values = np.concatenate([block.data for block, _, _ in blocks])
    rows = np.concatenate([block.row + row for block, row, _ in blocks])
    columns = np.concatenate([block.col + column for block, _, column in blocks])
    return sparse.csr_array((values, (rows, columns)), shape=(ends[-1], ends[-1]))


def _past_nodes(matrix: sparse.csr_array, n: int, n_nodes: int) -> sparse.csr_array:
    """Return the matrix between the first n values; values of nodes, without filter, drop out."""
    whole, passed = matrix[:n, :n], matrix[n:, :n]
    for _ in range(n_nodes):  # paths through one node, then two, and so on
        whole = whole + matrix[:n, n:] @ passed
        passed = matrix[n:, n:] @ passed
    return whole


def _largest(matrix: sparse.csr_array) -> tuple[float, np.ndarray]:
    """Return the largest real part of the eigenvalues of a matrix, and an eigenvector of it."""
    if matrix.shape[0] <= MOST_DENSE:
        values, vectors = np.linalg.eig(matrix.toarray())
    else:
        try:
            # A fixed start vector: with ARPACK's own, which is random, hints would be random.
            start = np.ones(matrix.shape[0])
            values, vectors = sparse.linalg.eigs(matrix, k=1, which="LR", v0=start, tol=1e-3)
        except sparse.linalg.ArpackError:  # no eigenvalue is found: the gain is not known
            return 0.0, np.ones(matrix.shape[0])
    at = int(values.real.argmax())
    return float(values[at].real), vectors[:, at]
