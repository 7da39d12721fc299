"""The assembly of a flat network from groups, edges and the objects that stay."""

from collections import Counter, defaultdict
from collections.abc import Collection

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.ensemble import Neurons
from nengo.solvers import NoSolver

from spikeport.compile.ground.filters import keeps_constants
from spikeport.compile.ground.names import End, span
from spikeport.compile.ground.notices import warnings_about
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import is_called
from spikeport.compile.loihi.quick_builder import FEW
from spikeport.compile.loihi.readout import readout_scale
from spikeport.compile.loihi.solver import ParameterSolver, nengo_transform
from spikeport.compile.rewriting.edges import EdgeKey, Edges, EdgeSource, EdgeTarget, without_zeros
from spikeport.compile.rewriting.flat_network import FlatNetwork, start
from spikeport.compile.rewriting.partition import Partition

FIRING = 1e3
"""A current at which every neuron fires."""
POINTS = 1_000
"""The most evaluation points of a group, which may have hundreds of dimensions."""


class Assembly:
    """A flat network of groups, edges and the objects that stay.

    Parameters
    ----------
    rewrite : Rewrite
        The network before.
    solver : ParameterSolver
        Solves its gains, biases and encoders.
    partition : Partition
        The groups.
    edges : Edges
        The connections.
    filtered_constants : bool
        Constants behind a synapse become biases too; else only constants without a synapse.
    summed : collection of nengo.Node
        Constants that the host adds to other values: they become biases only where it sends no
        other values, since it may be the sum alone that is within the radius.

    Attributes
    ----------
    flat : FlatNetwork
        The new network, without the objects that stay: these must be kept before `connect`.
    ensembles : list of nengo.Ensemble
        The ensemble of each group.
    encoded : dict of nengo.Connection to (n,) array
        The connections that encode the host's values, and the dimensions of these values.
    """

    def __init__(
        self,
        rewrite: Rewrite,
        solver: ParameterSolver,
        partition: Partition,
        edges: Edges,
        filtered_constants: bool = False,
        summed: Collection[nengo.Node] = (),
    ) -> None:
        self._scope = rewrite.scope
        self._dt_s = solver.dt_s
        self.flat = FlatNetwork(rewrite.network, solver.seeds)
        fixed, self._edges = self._separated(without_zeros(edges), filtered_constants, summed)
        constant: dict[int, Edges] = defaultdict(dict)
        for key, matrix in fixed.items():
            constant[key.target.group][key] = matrix
        self._computed: dict[nengo.Connection, nengo.Node] = {}
        self.encoded: dict[nengo.Connection, np.ndarray] = {}
        groups = _Groups(rewrite, solver, partition)
        with self.flat.network:
            self.ensembles = [
                groups.ensemble(number, constant[number]) for number in range(len(partition.groups))
            ]

    def _separated(
        self, edges: Edges, filtered: bool, summed: Collection[nengo.Node]
    ) -> tuple[Edges, Edges]:
        """Return the constants that become biases, and the other edges.

        The rows of a summed constant are divided between both, by the dimensions that get other
        values from the host.
        """
        fixed = {key: matrix for key, matrix in edges.items() if _is_constant(key, filtered)}
        others = {key: matrix for key, matrix in edges.items() if key not in fixed}
        sent: dict[EdgeTarget, np.ndarray] = {}
        for key, matrix in others.items():
            if self._is_encoded(key):
                sent[key.target] = sent.get(key.target, 0) + abs(matrix).sum(axis=1)
        for key in [key for key in fixed if key.source.obj in summed and key.target in sent]:
            stays = sparse.diags_array((sent[key.target] > 0).astype(float))
            others[key] = sparse.csr_array(stays @ fixed[key])
            fixed[key] = fixed[key] - others[key]
        return fixed, without_zeros(others)

    def connect(self) -> None:
        """Add the connections."""
        inputs: dict[int, Edges] = defaultdict(dict)
        outputs: dict[int, Edges] = defaultdict(dict)
        with self.flat.network:
            self._compute_once()
            for key, matrix in self._edges.items():
                if self._is_encoded(key):
                    inputs[key.target.group][key] = matrix
                elif key.source.in_group and not self._to_chip(key.target):
                    outputs[key.source.group][key] = matrix
                else:
                    self._connect(key, self._end(key.target), matrix)
            for group, edges in inputs.items():
                self._connect_input(group, edges)
            for group, edges in outputs.items():
                self._connect_output(group, edges)

    def _compute_once(self) -> None:
        """Make a node for each function that several edges start at, so that it is called once."""
        found = Counter(key.source.connection for key in self._edges)
        for old, n_edges in found.items():
            if old is None or n_edges == 1 or not is_called(old):
                continue
            self._computed[old] = self.flat.computed(old, self._scope.names[old])

    def _connect_input(self, group: int, edges: Edges) -> None:
        """Sum all values that the host sends to a group, in units of the radius, in one node."""
        ensemble = self.ensembles[group]
        rows = np.flatnonzero(sum(abs(matrix).sum(axis=1) for matrix in edges.values()))
        node = nengo.Node(size_in=len(rows), label=f"{ensemble.label} input")
        for key, matrix in edges.items():
            self._connect(key, node, matrix[rows] / ensemble.radius)
        # The encoders are weights to neurons: other dimensions would be stored in vain.
        encoders = ensemble.encoders[:, rows]
        wired = nengo.Connection(node, ensemble.neurons, transform=encoders, synapse=None)
        self.flat.network.config[wired].decode_path = "direct"
        self.encoded[wired] = rows

    def _connect_output(self, group: int, edges: Edges) -> None:
        """Decode all values that the host reads of a group at once, scaled; it scales them back."""
        ensemble = self.ensembles[group]
        rows = {key: np.flatnonzero(abs(matrix).sum(axis=1)) for key, matrix in edges.items()}
        decoders = sparse.vstack([edges[key][rows[key]] for key in edges]).toarray()
        # The rows share one scale of weights: large rows would take the bits of small ones.
        scale = readout_scale(decoders, ensemble, self._dt_s)
        node = nengo.Node(size_in=len(decoders), label=f"{ensemble.label} output")
        nengo.Connection(
            ensemble,
            node,
            function=np.zeros((1, len(decoders))),
            eval_points=_firing_point(ensemble.gain, ensemble.bias, ensemble.encoders),
            solver=NoSolver((decoders / scale[:, np.newaxis]).T),
            synapse=None,
        )
        first = 0
        for key, mine in rows.items():
            part = slice(first, first + len(mine))
            back = _scaled_back(key.target.obj.size_in, mine, scale[part])
            nengo.Connection(node[part], key.target.obj, transform=back, synapse=key.synapse)
            first += len(mine)

    def _connect(self, key: EdgeKey, target: End, matrix: sparse.csr_array) -> None:
        """Connect one edge as it is."""
        source, old = key.source, key.source.connection
        pre, options = (self._start(source), {}) if old is None else start(old)
        if old in self._computed:
            pre, options, old = self._computed[old], {}, None
        is_neurons = source.in_group or isinstance(source.obj, Neurons)
        # nengo-loihi takes no sparse transform from values, from the host, or to it.
        may_be_sparse = is_neurons and self._from_chip(source) and self._to_chip(key.target)
        # Nengo calls a function once to see how many values it returns.
        with warnings_about("" if old is None else self._scope.names[old]):
            connection = nengo.Connection(
                pre,
                target,
                synapse=key.synapse,
                transform=nengo_transform(matrix) if may_be_sparse else matrix.toarray(),
                **options,
            )
        if old is not None:
            # Its decoders are solved once more, and the same seed keeps them equal.
            self.flat.inherit(connection, old)
        if key.path is not None or key.target.kind == "neurons":
            self.flat.network.config[connection].decode_path = key.path or "direct"

    def _start(self, source: EdgeSource) -> End:
        if source.in_group:
            return self.ensembles[source.group].neurons
        return source.obj

    def _end(self, target: EdgeTarget) -> End:
        if not target.in_group:
            return target.obj
        ensemble = self.ensembles[target.group]
        return ensemble.neurons if target.kind == "neurons" else ensemble

    def _from_chip(self, source: EdgeSource) -> bool:
        return source.in_group or self._scope.on_chip(source.obj)

    def _is_encoded(self, key: EdgeKey) -> bool:
        """Return whether the host encodes an edge's values; spikes of its neurons are relayed."""
        by_host = not self._from_chip(key.source) and not isinstance(key.source.obj, Neurons)
        return key.target.kind == "dimensions" and by_host

    def _to_chip(self, target: EdgeTarget) -> bool:
        return target.in_group or self._scope.on_chip(target.obj)


def _is_constant(key: EdgeKey, filtered: bool) -> bool:
    """Return whether an edge adds a constant to neurons, ignoring its filter if ``filtered``."""
    source = key.source
    node = source.connection is None and isinstance(source.obj, nengo.Node)
    fixed = node and isinstance(source.obj.output, np.ndarray)
    # The output of a filter starts at zero.
    passed = keeps_constants(key.synapse) if filtered else key.synapse is None
    return fixed and passed and key.target.in_group


class _Groups:
    """The ensembles that groups become: the built parameters of their parts, put together."""

    def __init__(self, rewrite: Rewrite, solver: ParameterSolver, partition: Partition) -> None:
        self._names = rewrite.names
        self._solver = solver
        self._partition = partition

    def ensemble(self, number: int, constants: Edges) -> nengo.Ensemble:
        """Make the ensemble of a group; constant input becomes bias."""
        radius = self._partition.radius[number]
        gain, bias = self._joined(number, "gain"), self._joined(number, "bias")
        encoders = self._encoders(number)
        for key, matrix in constants.items():
            drive = matrix @ key.source.obj.output
            current = drive if key.target.kind == "neurons" else encoders @ drive / radius
            bias = bias + gain * current
        return nengo.Ensemble(
            len(gain),
            encoders.shape[1],
            radius=radius,
            gain=gain,
            bias=bias,
            encoders=encoders,
            normalize_encoders=False,  # already normalised, if the user asked for it
            eval_points=self._points(number, gain, bias, encoders),
            neuron_type=self._neuron_type(number),
            label=self._label(number),
        )

    def _points(
        self, number: int, gain: np.ndarray, bias: np.ndarray, encoders: np.ndarray
    ) -> np.ndarray:
        """Return values (n, d) that the parts represent, in units of the radius.

        Ranges of relays are found from them. If no neuron fires at the first of these, nengo-loihi
        needs a value at which one does.
        """
        parts = [part.ensemble for part in self._partition.groups[number]]
        own = [self._solver.ensemble(part).eval_points / part.radius for part in parts]
        rows = np.arange(min(POINTS, max(map(len, own))))
        points: np.ndarray = np.hstack([values[rows % len(values)] for values in own])
        fires = parts[0].neuron_type.rates(points[:FEW] @ encoders.T, gain, bias).any()
        return points if fires else _firing_point(gain, bias, encoders)

    def _joined(self, number: int, name: str) -> np.ndarray:
        parts = self._partition.groups[number]
        built = [getattr(self._solver.ensemble(part.ensemble), name) for part in parts]
        return np.concatenate([b[p.start : p.stop] for b, p in zip(built, parts, strict=True)])

    def _encoders(self, number: int) -> np.ndarray:
        """Return encoders (n, d); each part has dimensions of its own."""
        parts = self._partition.groups[number]
        built = [self._solver.ensemble(part.ensemble).encoders for part in parts]
        blocks = [b[p.start : p.stop] for b, p in zip(built, parts, strict=True)]
        encoders: np.ndarray = sparse.block_diag(blocks).toarray()
        return encoders

    def _neuron_type(self, number: int) -> nengo.neurons.NeuronType:
        """Return the parts' neuron type, in which each neuron keeps its initial state."""
        parts = self._partition.groups[number]
        states = [self._solver.initial_state(part.ensemble) for part in parts]
        pairs = list(zip(states, parts, strict=True))
        start = {
            name: np.concatenate([s[name][p.start : p.stop] for s, p in pairs])
            for name in states[0]
        }
        kind = parts[0].ensemble.neuron_type
        # Constructors differ from type to type, but the state of any frozen object can be copied.
        copy: nengo.neurons.NeuronType = object.__new__(type(kind))
        copy.__setstate__({**kind.__getstate__(), "initial_state": start})
        return copy

    def _label(self, number: int) -> str:
        parts = self._partition.groups[number]
        first, last = (self._names[part.ensemble] for part in (parts[0], parts[-1]))
        if len(parts) > 1:
            return span(first, last)
        groups = [place.group for place in self._partition.places[parts[0].ensemble]]
        return first if len(groups) == 1 else f"{first}[{groups.index(number) + 1}/{len(groups)}]"


def _firing_point(gain: np.ndarray, bias: np.ndarray, encoders: np.ndarray) -> np.ndarray:
    """Return a value (1, d), in units of the radius, at which some neuron fires.

    nengo-loihi needs one to decode.
    """
    length = np.linalg.norm(encoders, axis=1)
    best = int(np.argmax(gain * length))
    if gain[best] * length[best] == 0:
        return np.zeros((1, encoders.shape[1]))
    value = (FIRING - bias[best]) / (gain[best] * length[best])
    point: np.ndarray = encoders[best] / length[best] * value
    return point[np.newaxis]


def _scaled_back(size: int, rows: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return the transform of values that are scaled into rows of a target of some size."""
    if len(rows) == size:
        return scale  # Nengo takes a vector for a diagonal matrix
    back = np.zeros((size, len(rows)))
    back[rows, np.arange(len(rows))] = scale
    return back
