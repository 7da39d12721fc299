"""The signals of a graph: matrices from its inputs and populations, in place of linear nodes.

    x_k = sum_j M_kj s_j + b_k

where s_j are the spikes of population or input j. A linear node adds its bias once, however many
nodes lead to it.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.networks.loading.nir.dynamics import own_shape
from spikeport.networks.loading.nir.graph import NEURONS, Graph, Node
from spikeport.networks.loading.nir.operators import SIZE, Shape, fit, operator
from spikeport.reading.mismatch import MismatchError

MOST_WEIGHTS = 2**26
"""The most weights in the matrices into all nodes together: a gigabyte."""
MOST_PRODUCTS = 2**27
"""The most products of two weights in a matrix product: seconds of work, and as many weights."""


class Signal(NamedTuple):
    """A sum of spikes times a matrix for each source, plus a constant, and its shape.

    ``delays`` has the steps by which nodes of kind Delay hold each source back.
    """

    parts: dict[str, sparse.csr_matrix]
    constant: np.ndarray
    shape: Shape
    delays: dict[str, int]


class Signals:
    """The signals of a graph, each computed once, and the shape of each input and population."""

    def __init__(self, graph: Graph, dt_s: float) -> None:
        self._graph, self._dt_s = graph, dt_s
        self._left = MOST_WEIGHTS
        self._before: dict[str, list[str]] = {name: [] for name in graph.nodes}
        self._after: dict[str, list[str]] = {name: [] for name in graph.nodes}
        for source, target in graph.edges:
            for end, name, direction in (("Output", source, "out of"), ("Input", target, "into")):
                if graph.nodes[name].kind == end:
                    raise MismatchError(
                        f"{end.lower()} {name} without edges {direction} it", "an edge"
                    )
            self._before[target].append(source)
            self._after[source].append(target)
        self.shapes = {node.name: _shape(node) for node in graph.kinds("Input")}
        self.shapes |= {
            node.name: shape
            for node in graph.kinds(*NEURONS)
            if (shape := self._parameter_shape(node))
        }
        _check_size(self.shapes)
        self._done: dict[str, Signal] = {}
        self._compute()
        _check_size(self.shapes)

    def _parameter_shape(self, node: Node) -> Shape:
        """Return the shape of a node's parameters, or () if neurons have the shape of their input.

        A value may stand for all neurons, or for those of a channel: (2, 1, 1) for (2, 8, 8).
        """
        shape = own_shape(node)
        several = math.prod(shape) == 1 or 1 in shape[1:]
        return () if several and self._before[node.name] else shape or (1,)

    def _compute(self) -> None:
        """Go through the graph: linear nodes after all their sources, neurons after any source."""
        ends = [node.name for node in self._graph.kinds("Input", "Output", *NEURONS)]
        missing = {n: len(before) for n, before in self._before.items() if n not in ends}
        self._visit([*self.shapes, *(name for name, n in missing.items() if not n)], missing)
        for node in self._graph.kinds(*NEURONS):
            if node.name not in self.shapes:  # in a cycle that nothing else leads to
                self.shapes[node.name] = own_shape(node) or (1,)
                self._visit([node.name], missing)
        if missing:
            raise MismatchError(
                "neurons in every cycle", f"none in one through {self._in_cycle(missing)}"
            )

    def _visit(self, names: Sequence[str], missing: dict[str, int]) -> None:
        """Visit the nodes behind known ones; a linear node once all nodes before it are known."""
        known = deque(names)
        while known:
            name = known.popleft()
            if name in missing:
                del missing[name]
                self._done[name] = self._through(name)
            for target in self._after[name]:
                if target in missing:
                    missing[target] -= 1
                    if not missing[target]:
                        known.append(target)
                elif self._graph.nodes[target].kind != "Output" and target not in self.shapes:
                    self.shapes[target] = self._signal(name).shape
                    known.append(target)

    def _in_cycle(self, missing: Mapping[str, int]) -> str:
        """Return a node of a cycle, found by a walk against the edges."""
        name = next(iter(missing))
        for _ in missing:
            name = next(one for one in self._before[name] if one in missing)
        return name

    def into(self, name: str) -> Signal:
        """Return the sum of the signals into a node."""
        signals = [self._signal(one) for one in self._before[name]]
        if not signals:
            return self._nothing(name)
        wanted = self._wanted(name)
        given = [signal.shape for signal in signals] + ([] if wanted is None else [wanted])
        if not fit(*given):
            shapes = " and ".join(str(signal.shape) for signal in signals)
            raise MismatchError(f"{wanted or 'equal shapes'} into node {name}", shapes)
        parts, delays = _added(name, signals)
        constant = np.sum([signal.constant for signal in signals], axis=0)
        self._spend(constant.size + sum(matrix.nnz for matrix in parts.values()), name)
        return Signal(parts, constant, signals[0].shape, delays)

    def _spend(self, numbers: int, name: str) -> None:
        self._left -= numbers
        if self._left < 0:
            raise MismatchError(
                f"at most {MOST_WEIGHTS:,} weights in total", f"more, counted up to node {name}"
            )

    def _through(self, name: str) -> Signal:
        node = self._graph.nodes[name]
        signal = self.into(name)
        found = operator(node, signal.shape, self._dt_s)
        parts = {}
        for source, matrix in signal.parts.items():
            parts[source] = _product(found.matrix, matrix, name)
            self._spend(parts[source].nnz, name)
        delays = {source: n + found.n_steps for source, n in signal.delays.items()}
        return Signal(parts, found.matrix @ signal.constant + found.bias, found.shape, delays)

    def _wanted(self, name: str) -> Shape | None:
        """Return the shape of input that a node declares, if any."""
        node = self._graph.nodes[name]
        return (node.whole("shape") or None) if node.kind == "Output" else self.shapes.get(name)

    def _signal(self, name: str) -> Signal:
        """Return the output of a node."""
        if name in self._done:
            return self._done[name]
        shape = self.shapes[name]
        n = math.prod(shape)
        return Signal({name: sparse.eye_array(n, format="csr")}, np.zeros(n), shape, {name: 0})

    def _nothing(self, name: str) -> Signal:
        if name not in self.shapes:
            raise MismatchError(f"an edge that leads to node {name}", "none")
        shape = self.shapes[name]
        return Signal({}, np.zeros(math.prod(shape)), shape, {})


def _added(
    name: str, signals: Sequence[Signal]
) -> tuple[dict[str, sparse.csr_matrix], dict[str, int]]:
    """Return the sum of matrices for each source of a node, and its delay."""
    parts: dict[str, sparse.csr_matrix] = {}
    delays: dict[str, int] = {}
    for signal in signals:
        for source, matrix in signal.parts.items():
            parts[source] = parts[source] + matrix if source in parts else matrix
            n = signal.delays[source]
            if delays.setdefault(source, n) != n:
                raise unequal_delays(name, sorted([delays[source], n]))
    return parts, delays


def _product(a: sparse.csr_matrix, b: sparse.csr_matrix, name: str) -> sparse.csr_matrix:
    """Return the product of two matrices, unless it takes too many products of weights."""
    n_products = int(np.bincount(a.indices, minlength=a.shape[1]) @ np.diff(b.indptr))
    if n_products > MOST_PRODUCTS:
        raise MismatchError(
            f"at most {MOST_PRODUCTS:,} multiplications for a matrix of node {name}",
            f"{n_products:,}",
        )
    return (a @ b).tocsr()


def _shape(node: Node) -> Shape:
    shape = node.whole("shape")
    if not shape or min(shape) < 1 or math.prod(shape) > SIZE:
        raise MismatchError(f"from 1 to {SIZE:,} values of input {node.name}", f"{shape}")
    return shape


def _check_size(shapes: Mapping[str, Shape]) -> None:
    n = sum(map(math.prod, shapes.values()))
    if n > SIZE:
        raise MismatchError(f"at most {SIZE:,} inputs and neurons", f"{n:,}")


def unequal_delays(name: str, delays: Sequence[int]) -> MismatchError:
    """Return the error for a node whose inputs arrive with these delays."""
    return MismatchError(
        f"equal delays on all paths to node {name}",
        " and ".join(map(str, delays)) + " steps",
        cure="on the chip every connection takes one step: delay all paths alike, or none",
    )
