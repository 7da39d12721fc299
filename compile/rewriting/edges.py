"""Connections as matrices between groups of neurons and the objects that stay.

    target += synapse(matrix @ source)

Passthrough nodes between them are multiplied out.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.ensemble import Neurons

from spikeport.compile.ground.matrices import Matrix, full
from spikeport.compile.ground.names import End, base
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import full_weights, source_rows, target_rows
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.partition import Partition, Position

NO_GROUP = -1


class EdgeSource(NamedTuple):
    """The start of an edge.

    It is one of three: the neurons of a group; the whole output of `obj`, an object outside all
    groups; or, if `connection` is set, the values that this connection decodes, or computes by a
    function, from `obj`.
    """

    group: int
    obj: End = None
    connection: nengo.Connection | None = None

    @property
    def in_group(self) -> bool:
        """True if the source is the neurons of a group."""
        return self.group != NO_GROUP


class EdgeTarget(NamedTuple):
    """The end of an edge: the neurons or the dimensions of a group, or an object that stays."""

    kind: str
    group: int
    obj: End = None

    @property
    def in_group(self) -> bool:
        """True if the target is part of a group."""
        return self.group != NO_GROUP


class EdgeKey(NamedTuple):
    """The identity of an edge; the matrices of connections with equal keys add up.

    ``path`` is the setting ``decode_path`` of the connections, None where it is free.
    """

    source: EdgeSource
    target: EdgeTarget
    synapse: nengo.synapses.Synapse | None
    path: str | None


Edges = dict[EdgeKey, sparse.csr_array]
"""The matrix of each edge, (target size, source size)."""


class _Origin(NamedTuple):
    """An `EdgeKey` whose target is still open."""

    source: EdgeSource
    synapse: nengo.synapses.Synapse | None
    path: str | None


class _Entries(NamedTuple):
    """The entries of a matrix, row by row, in arrays (n,); ``shape`` is the matrix's shape.

    scipy's arrays check and convert at each operation, which takes longer than the arithmetic: most
    connections have few numbers.
    """

    shape: tuple[int, int]
    row: np.ndarray
    column: np.ndarray
    value: np.ndarray

    @property
    def dense(self) -> np.ndarray:
        """The matrix; no place has two entries."""
        whole = np.zeros(self.shape)
        whole[self.row, self.column] = self.value
        return whole


class _Destination(NamedTuple):
    """The row of a target for each of a connection's values, -1 for values that do not go there.

    Values are multiplied by a factor, or by a matrix; ``rows`` are then those of the product.
    """

    target: EdgeTarget
    rows: np.ndarray
    factor: np.ndarray | float = 1.0


class EdgeMatrices:
    """The connections of a network as edges.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    reads : sequence of nengo.Connection
        More connections, which are not part of the network.
    solver : ParameterSolver
        Solves its decoders and encoders.
    partition : Partition
        The groups of the ensembles that do not stay.
    folded : sequence of nengo.Node
        The passthrough nodes that are multiplied out, sources first.

    Attributes
    ----------
    edges : Edges
        The edges between groups and objects that stay.
    into_nodes : dict of nengo.Node to Edges
        The edges that end in each passthrough node that was multiplied out.
    replaced : dict of nengo.Connection to None
        The connections that became edges, in order.

    Raises
    ------
    RefusedError
        If nengo-loihi's builder refuses an ensemble or a connection.
    """

    def __init__(
        self,
        rewrite: Rewrite,
        reads: Sequence[nengo.Connection],
        solver: ParameterSolver,
        partition: Partition,
        folded: Sequence[nengo.Node],
    ) -> None:
        network = rewrite.network
        self._encoded = {
            c: rows for c, rows in rewrite.encoded.items() if base(c.post_obj) in partition
        }
        self._on_chip = rewrite.scope.on_chip
        self._solver = solver
        self._partition = partition
        self._settings = NetworkSettings(network)
        self._blocks: dict[EdgeKey, list[_Entries]] = defaultdict(list)
        self.into_nodes: dict[nengo.Node, Edges] = {node: {} for node in folded}
        connections = [*network.all_connections, *reads]
        self.replaced = dict.fromkeys(filter(self._touches, connections))
        leaving = defaultdict(list)
        for connection in self.replaced:
            if connection.pre_obj in self.into_nodes:
                leaving[connection.pre_obj].append(connection)
            else:
                self._start(connection)
        # Sources come first, so all edges into a node are known before they are passed on.
        for node in folded:
            self.into_nodes[node] = self._edges_into(node)
            for connection in leaving[node]:
                self._pass_on(connection)
        self.edges = self._edges_into(None)

    def _touches(self, connection: nengo.Connection) -> bool:
        """Return whether an end of a connection does not stay."""
        ends = (base(connection.pre_obj), base(connection.post_obj))
        return any(end in self._partition or end in self.into_nodes for end in ends)

    def _start(self, connection: nengo.Connection) -> None:
        """Add a connection from the neurons of a group, or from an object that stays."""
        pre, places = connection.pre_obj, self._partition.places.get(base(connection.pre_obj))
        origin = _Origin(EdgeSource(NO_GROUP, pre), connection.synapse, self._path(connection))
        if places is not None:
            weights = self._solver.weights(connection)
            for place in places:
                # An ensemble that is split has its columns in several groups.
                mine = weights[:, place.part.start : place.part.stop]
                started = origin._replace(source=EdgeSource(place.group))
                self._add(connection, started, _entries(mine), place.neuron)
        elif full_weights(connection):
            # A connection with such a solver cannot end on neurons; one with its weights can.
            origin = origin._replace(source=EdgeSource(NO_GROUP, pre.neurons))
            self._add(connection, origin, _entries(self._solver.weights(connection)))
        elif isinstance(pre, nengo.Ensemble) or connection.function is not None:
            # Only the connection itself computes its function, so the result is the source.
            origin = origin._replace(source=EdgeSource(NO_GROUP, pre, connection))
            transform = self._solver.transform(connection)
            self._add(connection, origin, _entries(full(transform, connection.size_mid)))
        elif connection in self._encoded:
            self._add(connection, origin, _entries(np.eye(connection.size_mid)))
        else:
            self._add(connection, origin, _entries(self._solver.weights(connection)))

    def _pass_on(self, connection: nengo.Connection) -> None:
        """Multiply the edges into a passthrough node by a connection from it."""
        encodes = connection in self._encoded
        transform = np.ones(()) if encodes else self._solver.transform(connection)
        picked = source_rows(connection)
        for key, matrix in self.into_nodes[connection.pre_obj].items():
            # At most one of the two has a synapse: `passthrough` keeps a node between two.
            synapse, path = key.synapse or connection.synapse, key.path or self._path(connection)
            origin = _Origin(key.source, synapse, path)
            self._add(connection, origin, _passed_on(transform, matrix, picked))

    def _path(self, connection: nengo.Connection) -> str | None:
        if connection in self._encoded:
            return None
        path: str | None = self._settings.get(connection, "decode_path")
        return path

    def _add(
        self, connection: nengo.Connection, origin: _Origin, entries: _Entries, column: int = 0
    ) -> None:
        """Add a matrix from columns of an origin to each destination of a connection's values."""
        # Many of the m n matrices between m sources and n targets of a node may be all zeros.
        if not len(entries.value):
            return
        for to in self._destinations(connection):
            if isinstance(to.factor, np.ndarray):
                product = _entries(to.factor @ entries.dense)
            else:
                product = entries._replace(value=to.factor * entries.value)
            key = EdgeKey(origin.source, to.target, origin.synapse, origin.path)
            self._blocks[key].append(_placed(product, to.rows, column))

    def _destinations(self, connection: nengo.Connection) -> Iterator[_Destination]:
        post = connection.post_obj
        rows = target_rows(connection)
        if post in self.into_nodes or base(post) not in self._partition:
            # Values for an ensemble on the chip would be relayed, through another filter.
            if full_weights(connection) and self._on_chip(post):
                neurons, weights = np.arange(post.n_neurons), self._encoders(post)[:, rows]
                target = EdgeTarget("object", NO_GROUP, post.neurons)
                yield _Destination(target, neurons, factor=weights)
            else:
                yield _Destination(EdgeTarget("object", NO_GROUP, post), rows)
            return
        encoded = self._encoded.get(connection)
        for place in self._partition.places[base(post)]:
            # Inputs of a group are in units of its radius, the largest radius of its members.
            radius = self._partition.radius[place.group]
            dimensions = EdgeTarget("dimensions", place.group)
            if encoded is not None:
                yield _Destination(dimensions, encoded + place.dimension, factor=radius)
            elif isinstance(post, Neurons):
                yield _to_neurons(place, rows)
            elif full_weights(connection):
                yield self._to_encoded(place, rows)
            else:
                factor = radius / post.radius
                yield _Destination(dimensions, rows + place.dimension, factor=factor)

    def _to_encoded(self, place: Position, rows: np.ndarray) -> _Destination:
        """Return the neurons of a part as the destination of a solver's weights between neurons."""
        part = place.part
        weights = self._encoders(part.ensemble)[part.start : part.stop, rows]
        neurons = np.arange(part.size) + place.neuron
        return _Destination(EdgeTarget("neurons", place.group), neurons, factor=weights)

    def _encoders(self, ensemble: nengo.Ensemble) -> np.ndarray:
        """Return the weights (n, d) of an ensemble's values to its neurons."""
        encoders: np.ndarray = self._solver.ensemble(ensemble).encoders / ensemble.radius
        return encoders

    def _edges_into(self, node: nengo.Node | None) -> Edges:
        """Return all edges into a passthrough node; for None, all that end in no such node."""
        return {
            key: _sum(blocks, (self._size_in(key.target), self._size_out(key.source)))
            for key, blocks in self._blocks.items()
            if (key.target.obj is node if node else key.target.obj not in self.into_nodes)
        }

    def _size_in(self, target: EdgeTarget) -> int:
        if target.kind == "neurons":
            return self._partition.n_neurons[target.group]
        if target.kind == "dimensions":
            return self._partition.dimensions[target.group]
        return int(target.obj.size_in)

    def _size_out(self, source: EdgeSource) -> int:
        if source.in_group:
            return self._partition.n_neurons[source.group]
        return int(source.obj.size_out if source.connection is None else source.connection.size_mid)


def _to_neurons(place: Position, rows: np.ndarray) -> _Destination:
    """Return the destination, in one part, of a connection to some neurons of an ensemble."""
    part = place.part
    mine = (rows >= part.start) & (rows < part.stop)
    target = EdgeTarget("neurons", place.group)
    return _Destination(target, np.where(mine, rows - part.start + place.neuron, -1))


def _entries(matrix: Matrix) -> _Entries:
    """Return the entries of a matrix: the non-zero ones if it is dense, else the stored ones."""
    shape = (int(matrix.shape[0]), int(matrix.shape[1]))
    if isinstance(matrix, np.ndarray):
        row, column = matrix.nonzero()
        return _Entries(shape, row, column, matrix[row, column])
    row = np.repeat(np.arange(shape[0]), np.diff(matrix.indptr))
    return _Entries(shape, row, matrix.indices, matrix.data)


def _passed_on(transform: Matrix, matrix: sparse.csr_array, picked: np.ndarray) -> _Entries:
    """Return a transform times the picked rows of a matrix."""
    if transform.ndim == 2:
        return _entries(transform @ matrix[picked])
    begin, end = matrix.indptr[picked], matrix.indptr[picked + 1]
    row = np.repeat(np.arange(len(picked)), end - begin)
    # The places of the entries of the picked rows, row after row.
    at = np.arange(len(row)) + (end - np.cumsum(end - begin))[row]
    factors = np.broadcast_to(transform, len(picked))
    shape = (len(picked), int(matrix.shape[1]))
    return _Entries(shape, row, matrix.indices[at], factors[row] * matrix.data[at])


def _placed(entries: _Entries, rows: np.ndarray, column: int) -> _Entries:
    """Return entries moved to other rows, -1 for none, and to the right by ``column``."""
    row, placed = rows[entries.row], entries.column + column
    kept = row >= 0
    if kept.all():
        return entries._replace(row=row, column=placed)
    return _Entries(entries.shape, row[kept], placed[kept], entries.value[kept])


def _sum(blocks: Sequence[_Entries], shape: tuple[int, int]) -> sparse.csr_array:
    # Blocks may overlap: entries that occur twice add up as the coordinates are compressed.
    rows, columns, values = (
        np.concatenate([getattr(block, name) for block in blocks])
        for name in ("row", "column", "value")
    )
    return sparse.csr_array(sparse.coo_array((values, (rows, columns)), shape=shape))


def without_zeros(edges: Mapping[EdgeKey, sparse.csr_array]) -> Edges:
    """Return the edges whose matrix is not zero throughout."""
    return {key: matrix for key, matrix in edges.items() if abs(matrix).sum() > 0}
