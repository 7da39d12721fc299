"""Which passthrough nodes a matrix can replace, and in which order.

A cluster of connected passthrough nodes is a matrix from what enters to what leaves it, exactly,
if it has no loop, its transforms are matrices, nothing in it is a function, and no way through it
has more than one synapse (two low-pass filters in a row are not one).
"""

from collections import defaultdict
from collections.abc import Callable
from graphlib import CycleError, TopologicalSorter
from typing import Any

import nengo
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.csgraph import connected_components

PLAIN = (nengo.Dense, nengo.transforms.NoTransform)
Connections = list[nengo.Connection]


def foldable(network: nengo.Network, on_chip: Callable[[Any], bool]) -> list[nengo.Node]:
    """The passthrough nodes between ensembles on the chip, or to or from them, sources first."""
    nodes = [node for node in network.all_nodes if node.output is None]
    order: list[nengo.Node] = []
    for cluster, connections in _clusters(nodes, network.all_connections):
        ends = [end for c in connections for end in (c.pre_obj, c.post_obj) if end not in cluster]
        if any(on_chip(end) for end in ends):
            order += _order(cluster, connections)
    return order


def _clusters(
    nodes: list[nengo.Node], connections: Connections
) -> list[tuple[dict[nengo.Node, None], Connections]]:
    number = {node: i for i, node in enumerate(nodes)}
    inner = [
        (number[c.pre_obj], number[c.post_obj])
        for c in connections
        if c.pre_obj in number and c.post_obj in number
    ]
    rows, columns = np.array(inner, dtype=int).reshape(-1, 2).T
    graph = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(nodes),) * 2)
    _, label = connected_components(graph, directed=False) if nodes else (0, [])
    clusters: dict[int, tuple[dict[nengo.Node, None], Connections]] = defaultdict(lambda: ({}, []))
    for node in nodes:
        clusters[label[number[node]]][0][node] = None
    for c in connections:
        touched = (label[number[end]] for end in (c.pre_obj, c.post_obj) if end in number)
        for one in dict.fromkeys(touched):
            clusters[one][1].append(c)
    return list(clusters.values())


def _order(cluster: dict[nengo.Node, None], connections: Connections) -> list[nengo.Node]:
    """The nodes of a cluster, sources first; none if it is not exactly a matrix."""
    if not all(_is_matrix(c, cluster) for c in connections):
        return []
    into = defaultdict(list)
    for c in connections:
        into[c.post_obj].append(c)
    sorter = TopologicalSorter(
        {n: [c.pre_obj for c in into[n] if c.pre_obj in cluster] for n in cluster}
    )
    try:
        order = list(sorter.static_order())
    except CycleError:
        return []
    synapses: dict[Any, int] = {}
    for obj in [*order, *(end for end in into if end not in cluster)]:
        ways = [synapses.get(c.pre_obj, 0) + (c.synapse is not None) for c in into[obj]]
        synapses[obj] = max(ways, default=0)
    return order if max(synapses.values()) <= 1 else []


def _is_matrix(connection: nengo.Connection, cluster: dict[nengo.Node, None]) -> bool:
    linear = connection.pre_obj not in cluster or connection.function is None
    learned = connection.learning_rule_type is not None
    return linear and not learned and isinstance(connection.transform, PLAIN)
