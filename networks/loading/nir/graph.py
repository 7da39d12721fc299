"""The nodes of a NIR graph, including nodes of graphs within it, and the edges between them."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from spikeport.reading.hdf5 import Value
from spikeport.reading.mismatch import MismatchError

CONVOLUTION = ("weight", "stride", "padding", "dilation", "groups")
POOLING = ("kernel_size", "stride", "padding")
FIELDS: dict[str, tuple[str, ...]] = {
    "Input": ("shape",),
    "Output": ("shape",),
    "Affine": ("weight", "bias"),
    "Linear": ("weight",),
    "Scale": ("scale",),
    "Conv1d": CONVOLUTION,
    "Conv2d": CONVOLUTION,
    "SumPool2d": POOLING,
    "AvgPool2d": POOLING,
    "Flatten": ("start_dim", "end_dim"),
    "Delay": ("delay",),
    "LIF": ("tau", "r", "v_leak", "v_threshold"),
    "CubaLIF": ("tau_syn", "tau_mem", "r", "v_leak", "v_threshold"),
    "IF": ("r", "v_threshold"),
    "LI": ("tau", "r", "v_leak"),
    "CubaLI": ("tau_syn", "tau_mem", "r", "v_leak"),
    "Threshold": ("threshold",),
}
"""The kinds of nodes, and the fields that each must have."""

SPIKING = ("LIF", "CubaLIF", "IF", "Threshold")
READOUTS = ("LI", "CubaLI")
NEURONS = (*SPIKING, *READOUTS)

NODES = 10_000
EDGES = 2 * NODES


@dataclass(frozen=True)
class Node:
    """A node: its name, prefixed by the names of the graphs around it, its kind, and parameters."""

    name: str
    kind: str
    values: Mapping[str, Value]

    def numbers(self, field: str) -> np.ndarray:
        """Return a parameter as finite numbers.

        Raises
        ------
        MismatchError
            The parameter is absent, or is not finite numbers.
        """
        value = self.values.get(field)
        if not isinstance(value, np.ndarray):
            found = "none" if value is None else "another value"
            raise MismatchError(f"numbers for {field} in node {self.name}", found)
        if not np.isfinite(value).all():
            raise MismatchError(
                f"finite numbers for {field} in node {self.name}", "NaN or infinity"
            )
        return value.astype(float)

    def whole(self, field: str, least: int = -1) -> tuple[int, ...]:
        """Return a parameter as whole numbers from ``least`` up to 2^20."""
        value = np.ravel(self.numbers(field))
        if value.size > 8 or (value != np.round(value)).any():
            raise MismatchError(f"whole numbers for {field} in node {self.name}", f"{value[:8]}")
        if value.size and (value.min() < least or value.max() > 2**20):
            raise MismatchError(
                f"{field} from {least} to {2**20:,} in node {self.name}", f"{value}"
            )
        return tuple(int(one) for one in value)

    def one(self, field: str, least: int = -1) -> int:
        """Return a parameter that is one whole number."""
        values = self.whole(field, least)
        if len(values) != 1:
            raise MismatchError(f"one number for {field} in node {self.name}", f"{len(values)}")
        return values[0]


@dataclass(frozen=True)
class Graph:
    """Nodes by name, and edges; a graph within the graph is replaced by its nodes."""

    nodes: dict[str, Node]
    edges: tuple[tuple[str, str], ...]

    def kinds(self, *kinds: str) -> list[Node]:
        """Return the nodes of some kinds."""
        return [node for node in self.nodes.values() if node.kind in kinds]


def flattened(values: Mapping[str, Value]) -> Graph:
    """Return the graph of a file's values.

    Raises
    ------
    MismatchError
        A node or an edge is not valid NIR, or cannot be put on a chip.
    """
    found = values.get("node")
    if not isinstance(found, dict):
        raise MismatchError("a NIR graph", "another HDF5 file")
    graph = _Flattening().graph(found, "", top=True)
    if len(set(graph.edges)) < len(graph.edges):
        (edge, _), *_ = Counter(graph.edges).most_common(1)
        raise MismatchError("no repeated edges", f"the edge from {edge[0]} to {edge[1]} twice")
    return graph


class _Flattening:
    """Builder of one flat graph from a graph and the graphs within it."""

    def __init__(self) -> None:
        self._n_nodes = 0

    def graph(self, values: Mapping[str, Value], prefix: str, top: bool) -> Graph:
        name = prefix.rstrip(".") or "the graph"
        if values.get("type") != "NIRGraph":
            raise MismatchError(f"{name} of type NIRGraph", f"{values.get('type')}"[:40])
        members = values.get("nodes")
        if not isinstance(members, dict):
            raise MismatchError(f"nodes in {name}", "none")
        nodes: dict[str, Node] = {}
        edges: list[tuple[str, str]] = []
        into, out_of = {}, {}
        for key, value in members.items():
            full = prefix + key
            if not isinstance(value, dict):
                raise MismatchError(f"a node {full}", "an array")
            if value.get("type") == "NIRGraph":
                inner = self.graph(value, f"{full}.", top=False)
                _check_names(nodes, inner.nodes)
                nodes |= inner.nodes
                edges += inner.edges
                into[full], out_of[full] = _ends(inner, full)
            else:
                _check_names(nodes, [full])
                nodes[full] = self._node(full, value, top)
                into[full] = out_of[full] = full
        for source, target in _pairs(values.get("edges"), name):
            edges.append((_known(out_of, prefix + source), _known(into, prefix + target)))
        return Graph(nodes, tuple(edges))

    def _node(self, name: str, values: dict[str, Value], top: bool) -> Node:
        self._n_nodes += 1
        if self._n_nodes > NODES:
            raise MismatchError(f"at most {NODES:,} nodes", "more")
        kind = values.get("type")
        if not isinstance(kind, str) or kind not in FIELDS:
            raise MismatchError(f"node {name} of a kind in {', '.join(FIELDS)}", f"{kind}"[:40])
        for field in FIELDS[kind]:
            if field not in values:
                raise MismatchError(f"{field} in {kind} {name}", "none")
        inner = not top and kind in ("Input", "Output")
        return Node(name, f"Inner{kind}" if inner else kind, values)


def _check_names(nodes: Mapping[str, Node], added: Iterable[str]) -> None:
    """Refuse a node of a graph within the graph that has the name of another: a.b, and b in a."""
    for name in added:
        if name in nodes:
            raise MismatchError(f"one node {name}", "another in a graph within the graph")


def _ends(graph: Graph, name: str) -> tuple[str, str]:
    """Return the input node and the output node of a graph within a graph."""
    ends = []
    for kind in ("InnerInput", "InnerOutput"):
        mine = [n.name for n in graph.kinds(kind) if n.name.count(".") == name.count(".") + 1]
        if len(mine) != 1:
            raise MismatchError(f"one {kind[5:]} in the graph {name}", f"{len(mine)}")
        ends += mine
    return ends[0], ends[1]


def _pairs(value: Value | None, name: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, np.ndarray) and not value.size:
        return
    if not isinstance(value, list) or len(value) % 2 or len(value) > 2 * EDGES:
        raise MismatchError(f"at most {EDGES:,} edges in {name}, each of two names", "other values")
    yield from zip(value[::2], value[1::2], strict=True)


def _known(names: Mapping[str, str], name: str) -> str:
    if name not in names:
        known = ", ".join(sorted(names))
        raise MismatchError(
            f"edges between the nodes {known}", f"an edge of {name}, which is not a node"
        )
    return names[name]
