"""The network that groups and wires describe."""

from collections import defaultdict
from typing import Any

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.solvers import NoSolver

from spikeport.compile.rewriting.flat import Flat
from spikeport.compile.rewriting.groups import Members
from spikeport.compile.rewriting.partition import Partition
from spikeport.compile.rewriting.readout import readout_scale
from spikeport.compile.rewriting.rewire import FUNCTION
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.rewriting.solved import Solved, transform_of
from spikeport.compile.rewriting.wires import Source, Target, Way, Wires
from spikeport.compile.verdict.lint import Scope


class Assembly:
    """Builds a flat network of groups, wires and the objects that stay.

    Parameters
    ----------
    rewrite : Rewrite
        The network before.
    solved : Solved
        Its gains, biases and encoders.
    partition : Partition
        The groups.
    wires : dict of Way to matrix
        The connections.
    dt_s : float
        The time step, in seconds.

    Attributes
    ----------
    flat : Flat
        The network after, without the objects that stay; to be taken over before `connect`.
    groups : list of nengo.Ensemble
        The ensemble of each group.
    """

    def __init__(
        self, rewrite: Rewrite, solved: Solved, partition: Partition, wires: Wires, dt_s: float
    ) -> None:
        before = rewrite.network
        self._scope = Scope(before, rewrite.names)
        self._dt_s = dt_s
        wires = {way: matrix for way, matrix in wires.items() if abs(matrix).sum() > 0}
        self.flat = Flat(before, solved.seeds)
        constant = {way: matrix for way, matrix in wires.items() if _is_constant(way)}
        members = Members(partition, solved, rewrite.names)
        with self.flat.network:
            self.groups = [
                members.ensemble(
                    number, {w: m for w, m in constant.items() if w.target.group == number}
                )
                for number in range(len(partition.groups))
            ]
        self._wires = {way: matrix for way, matrix in wires.items() if way not in constant}

    def connect(self) -> None:
        """Add the connections."""
        inputs: dict[int, Wires] = defaultdict(dict)
        outputs: dict[int, Wires] = defaultdict(dict)
        with self.flat.network:
            for way, matrix in self._wires.items():
                if way.target.kind == "dimensions" and not self._from_chip(way.source):
                    inputs[way.target.group][way] = matrix
                elif way.source.in_group and not self._to_chip(way.target):
                    outputs[way.source.group][way] = matrix
                else:
                    self._connect(way.source, self._end(way.target), way, matrix)
            for group, wires in inputs.items():
                self._input(group, wires)
            for group, wires in outputs.items():
                self._output(group, wires)

    def _input(self, group: int, wires: Wires) -> None:
        """Gather what comes from the host, in units of the radius: one node for each group."""
        ensemble = self.groups[group]
        rows = np.flatnonzero(sum(abs(matrix).sum(axis=1) for matrix in wires.values()))
        node = nengo.Node(size_in=len(rows), label=f"{ensemble.label} input")
        for way, matrix in wires.items():
            self._connect(way.source, node, way, matrix[rows] / ensemble.radius)
        encoders = ensemble.encoders[:, rows]
        wired = nengo.Connection(node, ensemble.neurons, transform=encoders, synapse=None)
        self.flat.network.config[wired].decode_path = "direct"

    def _output(self, group: int, wires: Wires) -> None:
        """Decode all that goes to the host at once, scaled, and scale it back there."""
        ensemble = self.groups[group]
        rows = {way: np.flatnonzero(abs(matrix).sum(axis=1)) for way, matrix in wires.items()}
        decoders = sparse.vstack([wires[way][rows[way]] for way in wires]).toarray()
        scale = readout_scale(decoders, ensemble, self._dt_s)
        node = nengo.Node(size_in=len(decoders), label=f"{ensemble.label} output")
        nengo.Connection(
            ensemble,
            node,
            function=np.zeros((1, len(decoders))),
            eval_points=ensemble.eval_points,
            scale_eval_points=False,
            solver=NoSolver((decoders / scale[:, np.newaxis]).T),
            synapse=None,
        )
        first = 0
        for way, mine in rows.items():
            place = slice(first, first + len(mine))
            back = np.zeros((way.target.obj.size_in, len(mine)))
            back[mine, np.arange(len(mine))] = scale[place]
            nengo.Connection(node[place], way.target.obj, transform=back, synapse=way.synapse)
            first += len(mine)

    def _connect(self, source: Source, target: Any, way: Way, matrix: sparse.csr_array) -> None:
        """Connect one wire as it is."""
        made = source.connection
        options: dict[str, Any] = {}
        if made is not None:
            options = {name: getattr(made, name) for name in FUNCTION}
        connection = nengo.Connection(
            self._start(source),
            target,
            synapse=way.synapse,
            transform=matrix.toarray() if not source.in_group else transform_of(matrix),
            **options,
        )
        if made is not None:
            self.flat.inherit(connection, made)
        if way.path is not None or way.target.kind == "neurons":
            self.flat.network.config[connection].decode_path = way.path or "direct"

    def _start(self, source: Source) -> Any:
        if source.in_group:
            return self.groups[source.group].neurons
        return source.obj if source.connection is None else source.connection.pre

    def _end(self, target: Target) -> Any:
        if not target.in_group:
            return target.obj
        ensemble = self.groups[target.group]
        return ensemble.neurons if target.kind == "neurons" else ensemble

    def _from_chip(self, source: Source) -> bool:
        return source.in_group or self._scope.on_chip(source.obj)

    def _to_chip(self, target: Target) -> bool:
        return target.in_group or self._scope.on_chip(target.obj)


def _is_constant(way: Way) -> bool:
    """Whether a wire adds the same to neurons in every step."""
    source = way.source
    node = source.connection is None and isinstance(source.obj, nengo.Node)
    fixed = node and isinstance(source.obj.output, np.ndarray)
    return fixed and way.synapse is None and way.target.in_group
