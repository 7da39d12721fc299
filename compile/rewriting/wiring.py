"""A network's connections as wires; passthrough nodes between them are multiplied out."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.ensemble import Neurons

from spikeport.compile.names import base
from spikeport.compile.rewriting.partition import Partition
from spikeport.compile.rewriting.settings import Settings
from spikeport.compile.rewriting.solved import Matrix, Solved, full, transformed
from spikeport.compile.rewriting.wires import NO_GROUP, Source, Target, Way, Wires


class _Stretch(NamedTuple):
    """A wire that is still on its way."""

    source: Source
    synapse: nengo.synapses.Synapse | None
    path: str | None


class _Block(NamedTuple):
    rows: np.ndarray
    column: int
    matrix: Matrix


class _End(NamedTuple):
    """Where a connection's values go: some of them, maybe multiplied, to rows of a target."""

    target: Target
    rows: np.ndarray
    values: Any = slice(None)
    factor: Any = 1.0


class Wiring:
    """Multiplies a network out.

    Parameters
    ----------
    network : nengo.Network
        The network.
    reads : sequence of nengo.Connection
        More connections, which are not part of it.
    solved : Solved
        Its decoders and encoders.
    partition : Partition
        Where the ensembles go that do not stay.
    folded : sequence of nengo.Node
        The passthrough nodes that are multiplied out, sources first.

    Attributes
    ----------
    wires : dict of Way to matrix
        (target size, source size) each.
    arriving : dict of nengo.Node to wires
        What arrives at each passthrough node that was multiplied out.
    replaced : dict of nengo.Connection
        The connections that became wires, in order.
    """

    def __init__(
        self,
        network: nengo.Network,
        reads: Sequence[nengo.Connection],
        solved: Solved,
        partition: Partition,
        folded: Sequence[nengo.Node],
    ) -> None:
        self._solved = solved
        self._partition = partition
        self._settings = Settings(network)
        self._blocks: dict[Way, list[_Block]] = defaultdict(list)
        self.arriving: dict[nengo.Node, Wires] = {node: {} for node in folded}
        connections = [*network.all_connections, *reads]
        self.replaced = dict.fromkeys(filter(self._touches, connections))
        leaving = defaultdict(list)
        for connection in self.replaced:
            if connection.pre_obj in self.arriving:
                leaving[connection.pre_obj].append(connection)
            else:
                self._begin(connection)
        for node in folded:
            self.arriving[node] = self._assemble(node)
            for connection in leaving[node]:
                self._continue(connection)
        self.wires = self._assemble(None)

    def _touches(self, connection: nengo.Connection) -> bool:
        ends = (base(connection.pre_obj), base(connection.post_obj))
        return any(end in self._partition or end in self.arriving for end in ends)

    def _begin(self, connection: nengo.Connection) -> None:
        """Lay wires from the neurons of a member, or from an object that stays."""
        pre, places = connection.pre_obj, self._partition.places.get(base(connection.pre_obj))
        stretch = _Stretch(Source(NO_GROUP, pre), connection.synapse, self._path(connection))
        if places is not None:
            weights = self._solved.weights(connection)
            for place in places:
                mine = weights[:, place.part.start : place.part.stop]
                begun = stretch._replace(source=Source(place.group))
                self._lay(connection, begun, mine, place.neuron)
        elif isinstance(pre, nengo.Ensemble) or connection.function is not None:
            stretch = stretch._replace(source=Source(NO_GROUP, pre, connection))
            transform = self._solved.transform(connection)
            self._lay(connection, stretch, full(transform, connection.size_mid))
        else:
            self._lay(connection, stretch, self._solved.weights(connection))

    def _continue(self, connection: nengo.Connection) -> None:
        """Lengthen what arrives at a passthrough node by a connection from it."""
        transform = self._solved.transform(connection)
        picked = np.arange(connection.pre_obj.size_out)[connection.pre_slice]
        for way, matrix in self.arriving[connection.pre_obj].items():
            synapse, path = way.synapse or connection.synapse, way.path or self._path(connection)
            longer = _Stretch(way.source, synapse, path)
            self._lay(connection, longer, transformed(transform, matrix[picked]))

    def _path(self, connection: nengo.Connection) -> str | None:
        path = self._settings.get(connection, "decode_path")
        return None if path == "auto" else path

    def _lay(
        self, connection: nengo.Connection, stretch: _Stretch, matrix: Matrix, column: int = 0
    ) -> None:
        for end in self._ends(connection):
            block = _Block(end.rows, column, _product(end.factor, matrix[end.values]))
            way = Way(stretch.source, end.target, stretch.synapse, stretch.path)
            self._blocks[way].append(block)

    def _ends(self, connection: nengo.Connection) -> Iterator[_End]:
        post = connection.post_obj
        rows = np.arange(post.size_in)[connection.post_slice]
        if post in self.arriving or base(post) not in self._partition:
            yield _End(Target("object", NO_GROUP, post), rows)
            return
        for place in self._partition.places[base(post)]:
            part = place.part
            neurons = Target("neurons", place.group)
            if isinstance(post, Neurons):
                mine = (rows >= part.start) & (rows < part.stop)
                yield _End(neurons, rows[mine] - part.start + place.neuron, mine)
            elif isinstance(connection.pre_obj, nengo.Ensemble) and connection.solver.weights:
                encoders = self._solved.ensemble(post).encoders[part.start : part.stop, rows]
                yield _End(
                    neurons, np.arange(part.size) + place.neuron, factor=encoders / post.radius
                )
            else:
                scale = self._partition.radius(place.group) / post.radius
                yield _End(Target("dimensions", place.group), rows + place.dimension, factor=scale)

    def _assemble(self, node: nengo.Node | None) -> Wires:
        """The matrices of all wires that end in a passthrough node, or else of all that do not."""
        return {
            way: _sum(blocks, (self._size_in(way.target), self._size_out(way.source)))
            for way, blocks in self._blocks.items()
            if (way.target.obj is node if node else way.target.obj not in self.arriving)
        }

    def _size_in(self, target: Target) -> int:
        if target.kind == "neurons":
            return self._partition.n_neurons(target.group)
        if target.kind == "dimensions":
            return self._partition.dimensions(target.group)
        return target.obj.size_in

    def _size_out(self, source: Source) -> int:
        if source.in_group:
            return self._partition.n_neurons(source.group)
        return source.obj.size_out if source.connection is None else source.connection.size_mid


def _product(factor: Any, matrix: Matrix) -> Matrix:
    return factor @ matrix if np.ndim(factor) else factor * matrix


def _sum(blocks: list[_Block], shape: tuple[int, int]) -> sparse.csr_array:
    parts = [sparse.coo_array(block.matrix) for block in blocks]
    pairs = list(zip(parts, blocks, strict=True))
    rows = np.concatenate([block.rows[part.row] for part, block in pairs])
    columns = np.concatenate([part.col + block.column for part, block in pairs])
    data = np.concatenate([part.data for part in parts])
    return sparse.csr_array(sparse.coo_array((data, (rows, columns)), shape=shape))
