"""Connections that replace passthrough nodes, without the faults of nengo-loihi's merging.

nengo-loihi gives them the default solver. It pairs two lists of indices entry by entry, where every
entry of one list should meet every entry of the other. It refuses transforms with a factor for each
value. And it asks Nengo for matrices at slices with an entry twice, which Nengo refuses; here they
become matrices between whole ends,

    W' = S W R^T,   S[rows[i], i] += 1,   R[sources[j], j] += 1

nengo-loihi leaves out transforms of at most 1e-8, which are not small for a small radius; here only
rounding is left out. It connects probed nodes, too, but not those that lead nowhere, whose probes
then record zeros.
"""

import contextlib
import copy
import functools
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeAlias

import nengo
import numpy as np
from nengo.connection import FunctionInfo
from nengo.exceptions import BuildError
from nengo.solvers import NoSolver
from nengo_loihi import passthrough

from spikeport.compile.ground.matrices import full, placed
from spikeport.compile.ground.scope import reads_twice, source_rows, target_rows
from spikeport.compile.loihi.replaced import StandIn, replaced

Synapse: TypeAlias = nengo.synapses.Synapse | None
ROUNDING = 1e-15
"""The largest entry of a transform that is 0 but for rounding, as in circular convolution."""
FailedAt: TypeAlias = Callable[[Iterable[nengo.Node]], None]


@contextlib.contextmanager
def merged_in_full(failed_at: FailedAt) -> Iterator[None]:
    """Let nengo-loihi merge connections through passthrough nodes correctly, within the context.

    nengo-loihi's refusals to merge connections do not name a node. So before one is raised,
    ``failed_at`` is called with the nodes whose connections it may be about.
    """
    with (
        replaced(passthrough, "Cluster", functools.partial(MergedCluster, failed_at)),
        replaced(passthrough, "np", StandIn(np, allclose=_are_rounding)),
    ):
        yield


def _are_rounding(matrix: np.ndarray, _zero: float) -> bool:
    """Return whether entries of a transform are zeros, but for rounding."""
    return bool((np.abs(matrix) <= ROUNDING).all())


class MergedCluster(passthrough.Cluster):
    """Passthrough nodes that are connected to each other, merged as float Nengo computes them.

    Parameters
    ----------
    failed_at : callable
        Called with nodes, before a refusal to merge connections at one of them.
    node : nengo.Node
        The first node.
    """

    def __init__(self, failed_at: FailedAt, node: nengo.Node) -> None:
        super().__init__(node)
        self._failed_at = failed_at

    def generate_conns(self) -> Iterator[nengo.Connection]:
        """Yield the connections that replace the nodes, each with its solver."""
        for solver, part in _by_solver(self):
            for connection in super(MergedCluster, part).generate_conns():
                connection.solver = solver
                yield connection

    def generate_from(
        self,
        obj: nengo.Node,
        outputs: dict[nengo.Node, set[nengo.Connection]],
        previous: list[nengo.Node] | None = None,
    ) -> Iterator[tuple[Any, ...]]:
        """Yield the paths from a node to outputs and probed nodes."""
        if obj in self.probed_objs:
            outputs.setdefault(obj, set())  # nengo-loihi stops at a node without an entry
        yield from super().generate_from(obj, outputs, previous)

    def merge_transforms(
        self, node: nengo.Node, sizes: Any, transforms: Any, slices: Sequence[Any]
    ) -> nengo.Dense:
        """Return the transform through a node; the slices are that into it, and that out of it."""
        if not any(isinstance(part, slice) for part in slices):
            into, out = slices
            slices = np.ix_(out, into)[::-1]
        try:
            return super().merge_transforms(node, sizes, [*map(_as_matrix, transforms)], slices)
        except Exception:
            self._failed_at([node])
            raise

    def merge_synapses(self, syn1: Synapse, syn2: Synapse) -> Synapse:
        """Return the filter of a connection into a node and one from it; both must be low-pass."""
        filters = [one for one in (syn1, syn2) if one is not None]
        if len(filters) == 2 and not all(isinstance(one, nengo.Lowpass) for one in filters):
            # The first filter is that of a connection into a node of the cluster.
            into = (*self.conns_in, *self.conns_mid)
            self._failed_at(c.post_obj for c in into if c.synapse is syn1)
            kinds = " and ".join(type(one).__name__ for one in filters)
            raise BuildError(f"cannot merge the filters before and behind it, {kinds}")
        both: Synapse = super().merge_synapses(syn1, syn2)
        return both


def _by_solver(cluster: MergedCluster) -> Iterator[tuple[nengo.solvers.Solver, MergedCluster]]:
    """Yield each solver of connections into a cluster, and the cluster with only these."""
    solvers = {id(one.solver): one.solver for one in cluster.conns_in}
    into: dict[int, set[nengo.Connection]] = defaultdict(set)
    for one in cluster.conns_in:
        if one.function is not None:  # which reads the values in the slice, in their order
            whole = one
        elif isinstance(one.pre_obj, nengo.Ensemble):
            whole = _each_once(one)
        else:
            whole = _whole(one, source_rows(one))
        into[id(one.solver)].add(whole)
    conns_out = {_whole(one, target_rows(one)) for one in cluster.conns_out}
    for number, connections in into.items():
        part = copy.copy(cluster)
        part.conns_in, part.conns_out = connections, conns_out
        yield solvers[number], part


def _whole(connection: nengo.Connection, entries: np.ndarray) -> nengo.Connection:
    """Return a connection between whole ends, if ``entries`` of its slice has an entry twice."""
    factors = _factors(connection.transform)
    if factors is None or len(np.unique(entries)) == len(entries):
        return connection
    pre, post = connection.pre_obj, connection.post_obj
    matrix = full(factors, connection.size_mid)
    matrix = placed(matrix.T, source_rows(connection), pre.size_out).T
    return nengo.Connection(
        pre,
        post,
        synapse=connection.synapse,
        transform=placed(matrix, target_rows(connection), post.size_in),
        label=connection.label,
        add_to_container=False,
    )


def _each_once(connection: nengo.Connection) -> nengo.Connection:
    """Return a connection from an ensemble that decodes each entry of its slice once."""
    factors = _factors(connection.transform)
    if factors is None or not reads_twice(connection):
        return connection
    rows = source_rows(connection)
    entries, number = np.unique(rows, return_inverse=True)
    start, function = connection.pre_obj[entries.tolist()], None
    transform = placed(full(factors, connection.size_mid).T, number, len(entries)).T
    if isinstance(connection.solver, NoSolver):
        # The user's decoders have a column for each entry of the slice.
        start, function = connection.pre_obj, FunctionInfo(lambda x: x[rows], len(rows))
        transform = connection.transform
    return nengo.Connection(
        start,
        connection.post,
        function=function,
        synapse=connection.synapse,
        transform=transform,
        solver=connection.solver,
        eval_points=connection.eval_points,
        scale_eval_points=connection.scale_eval_points,
        label=connection.label,
        add_to_container=False,
    )


def _as_matrix(transform: nengo.transforms.Transform) -> nengo.transforms.Transform:
    """Return a transform with a matrix in place of a factor for each value."""
    factors = _factors(transform)
    if factors is None or factors.ndim != 1:
        return transform
    return nengo.Dense((factors.size, factors.size), init=np.diag(factors))


def _factors(transform: nengo.transforms.Transform) -> np.ndarray | None:
    """Return the factors or matrix of a transform; None if nengo-loihi does not merge it."""
    if isinstance(transform, nengo.transforms.NoTransform):
        return np.array(1.0)
    init = transform.init if isinstance(transform, nengo.Dense) else None
    return init if isinstance(init, np.ndarray) else None
