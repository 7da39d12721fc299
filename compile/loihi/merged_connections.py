"""Connections that replace passthrough nodes, without the faults of nengo-loihi's merging.

nengo-loihi gives them the default solver. It pairs two lists of indices entry by entry, where every
entry of one list should meet every entry of the other. It refuses transforms with a factor for each
value. And it asks Nengo for matrices at slices with an entry twice, which Nengo refuses; here they
become matrices between whole ends,

    W' = S W R^T,   S[rows[i], i] += 1,   R[sources[j], j] += 1

It connects probed nodes, too, but not those that lead nowhere, whose probes then record zeros.
"""

import contextlib
import copy
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeAlias

import nengo
import numpy as np
from nengo.exceptions import BuildError
from nengo_loihi.passthrough import Cluster

from spikeport.compile.ground.matrices import full, placed
from spikeport.compile.ground.refusal import TURN
from spikeport.compile.ground.scope import source_rows, target_rows
from spikeport.compile.loihi.replaced import replaced

MERGING = ("generate_conns", "generate_from", "merge_transforms", "merge_synapses")
"""The methods of nengo-loihi's `Cluster` that merge connections."""
Synapse: TypeAlias = nengo.synapses.Synapse | None


@contextlib.contextmanager
def merged_in_full(failed_at: Callable[[Iterable[nengo.Node]], None]) -> Iterator[None]:
    """Let nengo-loihi merge connections through passthrough nodes correctly, within the context.

    nengo-loihi's refusals to merge connections do not name a node. So before one is raised,
    ``failed_at`` is called with the nodes whose connections it may be about.
    """
    usual, follow, merge, join = (getattr(Cluster, name) for name in MERGING)

    def generated(cluster: Cluster) -> Iterator[nengo.Connection]:
        for solver, one in _by_solver(cluster):
            for connection in usual(one):
                connection.solver = solver
                yield connection

    def followed(
        cluster: Cluster,
        node: nengo.Node,
        outputs: dict[nengo.Node, set[nengo.Connection]],
        previous: list[nengo.Node] | None = None,
    ) -> Iterator[tuple[Any, ...]]:
        if node in cluster.probed_objs:
            outputs.setdefault(node, set())  # nengo-loihi stops at a node without an entry
        found: Iterator[tuple[Any, ...]] = follow(cluster, node, outputs, previous)
        return found

    def merged(
        cluster: Cluster, node: nengo.Node, sizes: Any, transforms: Any, slices: Sequence[Any]
    ) -> nengo.Dense:
        if not any(isinstance(part, slice) for part in slices):
            into, out = slices
            slices = np.ix_(out, into)[::-1]
        try:
            return merge(cluster, node, sizes, [*map(_as_matrix, transforms)], slices)
        except Exception:
            failed_at([node])
            raise

    def joined(cluster: Cluster, first: Synapse, second: Synapse) -> Synapse:
        filters = [one for one in (first, second) if one is not None]
        if len(filters) == 2 and not all(isinstance(one, nengo.Lowpass) for one in filters):
            # The first filter is that of a connection into a node of the cluster.
            into = (*cluster.conns_in, *cluster.conns_mid)
            failed_at(c.post_obj for c in into if c.synapse is first)
            kinds = " and ".join(type(one).__name__ for one in filters)
            raise BuildError(f"cannot merge the filters before and behind it, {kinds}")
        both: Synapse = join(cluster, first, second)
        return both

    with contextlib.ExitStack() as stack:
        stack.enter_context(TURN)
        for name, new in zip(MERGING, (generated, followed, merged, joined), strict=True):
            stack.enter_context(replaced(Cluster, name, new))
        yield


def _by_solver(cluster: Cluster) -> Iterator[tuple[nengo.solvers.Solver, Cluster]]:
    """Yield each solver of connections into a cluster, and the cluster with only these."""
    solvers = {id(one.solver): one.solver for one in cluster.conns_in}
    into: dict[int, set[nengo.Connection]] = defaultdict(set)
    for one in cluster.conns_in:
        # Functions and decoders apply to the values in the slice.
        of_slice = isinstance(one.pre_obj, nengo.Ensemble) or one.function is not None
        into[id(one.solver)].add(one if of_slice else _whole(one, source_rows(one)))
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
