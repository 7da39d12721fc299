"""A graph with one sparse matrix between two populations, in place of all linear nodes there.

    x_k = sum_j M_kj s_j + b_k

where s_j are the spikes of population or input j. A linear node adds its bias once, however many
nodes lead to it.
"""

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.networks.loading.nir.dynamics import Dynamics, dynamics, own_shape
from spikeport.networks.loading.nir.graph import NEURONS, READOUTS, Graph, Node
from spikeport.networks.loading.nir.operators import SIZE, Shape, operator
from spikeport.reading.mismatch import MismatchError

WEIGHTS = 2**26
"""In all matrices up to a node, of all nodes: a gigabyte."""
PRODUCTS = 2**27
"""The most products of weights of two nodes in a row: seconds of work, and as many weights."""
LATEST = 52
"""Steps by which the host can hold an input back: bits of a number."""
CONSTANTS: tuple[tuple[str, int, int | None], ...] = (
    ("bias", 0, None),
    ("start", 0, 1),
    ("second step", 1, 1),
)
"""Names of what is added to currents without a spike, its first step, and for how many."""


class Signal(NamedTuple):
    """A sum of spikes times matrices, by source, and a constant; and its shape.

    ``delays`` has the steps by which nodes of kind Delay hold each source back.
    """

    parts: dict[str, sparse.csr_matrix]
    constant: np.ndarray
    shape: Shape
    delays: dict[str, int]


@dataclass(frozen=True)
class Population:
    """Neurons of one node, and what reaches them.

    Attributes
    ----------
    node : Node
        The node.
    dynamics : Dynamics
        Its equations in a time step.
    input : Signal
        Its input.
    depth : int
        The longest way of spikes from an input to it, in connections.
    """

    node: Node
    dynamics: Dynamics
    input: Signal
    depth: int

    @property
    def size(self) -> int:
        """The number of neurons."""
        return self.dynamics.size

    @property
    def spikes(self) -> bool:
        """True if the neurons spike; others are read."""
        return self.node.kind not in READOUTS

    def constants(self) -> np.ndarray:
        """Return what is added to currents as `CONSTANTS` says, (3, n), in units of the voltage.

        A leak is a current that holds itself and is whole in the first step. Voltages begin at 0,
        which is not what they count from if the neurons reset to another one: a current has that
        difference in the first step alone.
        """
        of = self.dynamics
        filtered, start = 1 - of.current_decay, -(1 - of.voltage_decay) * of.reset
        bias = of.gain * self.input.constant + of.current_decay * of.leak
        return np.array([bias, filtered * of.leak + start, -filtered * start])


@dataclass(frozen=True)
class Folded:
    """A graph of populations.

    Attributes
    ----------
    dt_s : float
        The time step, in seconds.
    inputs : dict of str to Shape
        The shape of each input.
    populations : dict of str to Population
        The populations by name, each after those that lead to it, but for recurrence.
    outputs : dict of str to Signal
        The signals that are read.
    """

    dt_s: float
    inputs: dict[str, Shape]
    populations: dict[str, Population]
    outputs: dict[str, Signal]

    def late(self, population: Population) -> Iterator[tuple[str, int]]:
        """Yield the sources of which spikes arrive early, or late (negative), and the steps.

        NIR's ways within a step take no time; on the chip each connection takes a step. The host
        holds inputs back.
        """
        names = list(self.populations)
        for source in population.input.parts:
            if source in self.inputs:
                steps = population.depth - 1 - self.held(population)
            else:
                before = names.index(source) < names.index(population.node.name)
                steps = population.depth - self.populations[source].depth - before
            if steps:
                yield source, steps

    def held(self, population: Population) -> int:
        """Return the steps by which the host holds the inputs of a population back."""
        return min(population.depth - population.spikes, LATEST)


def folded(graph: Graph, dt_s: float) -> Folded:
    """Fold the linear nodes of a graph.

    Raises
    ------
    MismatchError
        Shapes do not fit, or something cannot be put on a chip: the message names the node.
    """
    signals = _Signals(graph, dt_s)
    inputs = {node.name: signals.shapes[node.name] for node in graph.kinds("Input")}
    found = {
        node.name: dynamics(node, signals.shapes[node.name], dt_s) for node in graph.kinds(*NEURONS)
    }
    into = {name: signals.into(name) for name in found}
    depths: dict[str, int] = {}
    populations = {}
    for name in _order(list(inputs), {name: list(one.parts) for name, one in into.items()}):
        before = [depths.get(source, 0) for source in into[name].parts]
        depths[name] = 1 + max(before, default=0)
        populations[name] = Population(graph.nodes[name], found[name], into[name], depths[name])
    outputs = {node.name: signals.into(node.name) for node in graph.kinds("Output")}
    _check_readouts(populations)
    graph_of = Folded(dt_s, inputs, populations, outputs)
    _check_delays(graph_of)
    _check_held(graph_of)
    return graph_of


def _shape(node: Node) -> Shape:
    shape = node.whole("shape")
    if not shape or min(shape) < 1 or math.prod(shape) > SIZE:
        raise MismatchError(f"from 1 to {SIZE:,} values of input {node.name}", f"{shape}")
    return shape


def _check_size(shapes: Mapping[str, Shape]) -> None:
    n = sum(map(math.prod, shapes.values()))
    if n > SIZE:
        raise MismatchError(f"at most {SIZE:,} inputs and neurons", f"{n:,}")


def _order(inputs: list[str], sources: dict[str, list[str]]) -> list[str]:
    """Return populations such that each comes after its sources, but for those of a cycle.

    A cycle is closed by what leads back to where a walk from the inputs, depth first, came from.
    """
    after: dict[str, list[str]] = {name: [] for name in [*inputs, *sources]}
    for name, before in sources.items():
        for source in before:
            after[source].append(name)
    started: set[str] = set()
    done = [one for name in after for one in _finished(name, after, started)]
    return [name for name in reversed(done) if name in sources]


def _finished(start: str, after: dict[str, list[str]], started: set[str]) -> Iterator[str]:
    """Yield what a walk from a node reaches that none before has, each after all behind it."""
    on_way = [] if start in started else [(start, iter(after[start]))]
    started.add(start)
    while on_way:
        name, rest = on_way[-1]
        following = next((one for one in rest if one not in started), None)
        if following is None:
            yield name
            on_way.pop()
        else:
            started.add(following)
            on_way.append((following, iter(after[following])))


def _check_readouts(populations: dict[str, Population]) -> None:
    for name, population in populations.items():
        for source in population.input.parts:
            if source in populations and not populations[source].spikes:
                raise MismatchError(
                    f"spikes into node {name}",
                    f"the voltage of {populations[source].node.kind} {source}",
                    cure="neurons on the chip send spikes alone: read it, or make it a LIF",
                )


def _check_delays(graph: Folded) -> None:
    """Refuse ways that are delayed otherwise than those beside them.

    Delays of all ways alike are none. What leads back takes the one step that a cycle needs, with
    a delay or without.
    """
    since = dict.fromkeys(graph.inputs, 0)
    for name, one in graph.populations.items():
        since[name] = _delay(name, one.input, since)
    for name, signal in graph.outputs.items():
        _delay(name, signal, since)
    for name, one in graph.populations.items():
        around = {s: since[s] + n - since[name] for s, n in one.input.delays.items()}
        for source, n in around.items():
            if n > 1:
                raise MismatchError(f"at most 1 delay in the cycle of {source} and {name}", f"{n}")


def _delay(name: str, signal: Signal, since: Mapping[str, int]) -> int:
    """Return the steps by which what reaches a node is delayed, by those of what is before it."""
    found = sorted({since[one] + n for one, n in signal.delays.items() if one in since})
    if len(found) > 1:
        raise _unlike(name, found)
    return found[0] if found else 0


def _unlike(name: str, delays: Sequence[int]) -> MismatchError:
    return MismatchError(
        f"equal delays on all ways to node {name}",
        " and ".join(map(str, delays)) + " steps",
        cure="on the chip every connection takes one step: delay all ways alike, or none",
    )


def _check_held(graph: Folded) -> None:
    ways = {
        (name, graph.held(one))
        for one in graph.populations.values()
        for name in one.input.parts
        if name in graph.inputs
    }
    n = sum(math.prod(graph.inputs[name]) for name, _ in ways)
    if n > SIZE:
        raise MismatchError(
            f"at most {SIZE:,} inputs, each once for each depth it leads to", f"{n:,}"
        )


class _Signals:
    """The signals of a graph, each computed once, and the shape of each input and population."""

    def __init__(self, graph: Graph, dt_s: float) -> None:
        self._graph, self._dt_s = graph, dt_s
        self._left = WEIGHTS
        self._before: dict[str, list[str]] = {name: [] for name in graph.nodes}
        self._after: dict[str, list[str]] = {name: [] for name in graph.nodes}
        for source, target in graph.edges:
            for end, name in (("Output", source), ("Input", target)):
                if graph.nodes[name].kind == end:
                    raise MismatchError(f"{end.lower()} {name} at an end", "it within a path")
            self._before[target].append(source)
            self._after[source].append(target)
        self.shapes = {node.name: _shape(node) for node in graph.kinds("Input")}
        self.shapes |= {
            node.name: shape for node in graph.kinds(*NEURONS) if (shape := self._alone(node))
        }
        _check_size(self.shapes)
        self._done: dict[str, Signal] = {}
        self._compute()
        _check_size(self.shapes)

    def _alone(self, node: Node) -> Shape:
        """Return the shape of neurons by themselves, () where it is that of what they get.

        A value may stand for all neurons, or for those of a channel: (2, 1, 1) for (2, 8, 8).
        """
        shape = own_shape(node)
        several = math.prod(shape) == 1 or 1 in shape[1:]
        return () if several and self._before[node.name] else shape or (1,)

    def _compute(self) -> None:
        """Go through the graph: linear nodes after all before them, neurons after any."""
        ends = [node.name for node in self._graph.kinds("Input", "Output", *NEURONS)]
        missing = {n: len(before) for n, before in self._before.items() if n not in ends}
        self._visit([*self.shapes, *(name for name, n in missing.items() if not n)], missing)
        for node in self._graph.kinds(*NEURONS):
            if node.name not in self.shapes:  # in a cycle that nothing else leads to
                self.shapes[node.name] = own_shape(node) or (1,)
                self._visit([node.name], missing)
        if missing:
            raise MismatchError("neurons in every cycle", f"none at {self._in_cycle(missing)}")

    def _visit(self, names: Sequence[str], missing: dict[str, int]) -> None:
        """Go on from nodes that are known, as far as all before a linear node is."""
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
        """Return a node of a cycle, to which a walk against the edges leads."""
        name = next(iter(missing))
        for _ in missing:
            name = next(one for one in self._before[name] if one in missing)
        return name

    def into(self, name: str) -> Signal:
        """Return the sum of what leads to a node."""
        signals = [self._signal(one) for one in self._before[name]]
        if not signals:
            return self._nothing(name)
        sizes = {math.prod(signal.shape) for signal in signals}
        wanted = self._wanted(name)
        if len(sizes) > 1 or (wanted is not None and sizes != {math.prod(wanted)}):
            shapes = " and ".join(str(signal.shape) for signal in signals)
            raise MismatchError(f"{wanted or 'equal shapes'} into node {name}", shapes)
        parts, delays = _added(name, signals)
        constant = np.sum([signal.constant for signal in signals], axis=0)
        self._left -= constant.size + sum(matrix.nnz for matrix in parts.values())
        if self._left < 0:
            raise MismatchError(f"at most {WEIGHTS:,} weights in all", f"more up to node {name}")
        return Signal(parts, constant, signals[0].shape, delays)

    def _through(self, name: str) -> Signal:
        node = self._graph.nodes[name]
        signal = self.into(name)
        found = operator(node, signal.shape, self._dt_s)
        parts = {
            source: _product(found.matrix, matrix, name) for source, matrix in signal.parts.items()
        }
        delays = {source: n + found.n_steps for source, n in signal.delays.items()}
        return Signal(parts, found.matrix @ signal.constant + found.bias, found.shape, delays)

    def _wanted(self, name: str) -> Shape | None:
        """Return the shape that a node says it takes, if any."""
        node = self._graph.nodes[name]
        return (node.whole("shape") or None) if node.kind == "Output" else self.shapes.get(name)

    def _signal(self, name: str) -> Signal:
        """Return what leaves a node."""
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
                raise _unlike(name, sorted([delays[source], n]))
    return parts, delays


def _product(a: sparse.csr_matrix, b: sparse.csr_matrix, name: str) -> sparse.csr_matrix:
    """Return the product of two matrices, if it is of a size that can be."""
    n_products = int(np.bincount(a.indices, minlength=a.shape[1]) @ np.diff(b.indptr))
    if n_products > PRODUCTS:
        raise MismatchError(
            f"matrices with at most {PRODUCTS:,} products up to node {name}", f"{n_products:,}"
        )
    return (a @ b).tocsr()
