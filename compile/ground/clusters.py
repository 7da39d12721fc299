"""Clusters of passthrough nodes that are connected to each other."""

from collections import defaultdict
from collections.abc import Callable, Container, Iterable, Iterator

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.base import NengoObject
from nengo.connection import LearningRule
from nengo.ensemble import Neurons

from spikeport.compile.ground.names import End
from spikeport.compile.ground.scope import Scope, is_passthrough

Nodes = dict[nengo.Node, None]
"""A set of nodes in order: the image must not depend on memory addresses."""
Connections = list[nengo.Connection]
ONE_SPIKE_A_STEP = (nengo.LIF, nengo.AdaptiveLIF, nengo.Izhikevich)
"""Types whose neurons spike at most once in a step: on the host, Nengo's others may more often."""


def clusters(network: nengo.Network) -> list[tuple[Nodes, Connections]]:
    """Return the clusters of passthrough nodes, each with all connections that touch it."""
    nodes = [node for node in network.all_nodes if is_passthrough(node)]
    connections = network.all_connections
    number = {node: i for i, node in enumerate(nodes)}
    inner = [
        (number[c.pre_obj], number[c.post_obj])
        for c in connections
        if c.pre_obj in number and c.post_obj in number
    ]
    rows, columns = np.array(inner, dtype=int).reshape(-1, 2).T
    graph = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(nodes),) * 2)
    _, label = sparse.csgraph.connected_components(graph, directed=False) if nodes else (0, [])
    found: dict[int, tuple[Nodes, Connections]] = defaultdict(lambda: ({}, []))
    for node in nodes:
        found[label[number[node]]][0][node] = None
    for c in connections:
        touched = (label[number[end]] for end in (c.pre_obj, c.post_obj) if end in number)
        for one in dict.fromkeys(touched):
            found[one][1].append(c)
    return list(found.values())


def stays(
    connections: Iterable[nengo.Connection],
    on_chip: Callable[[End], bool],
    probed: Container[NengoObject],
) -> bool:
    """Return whether a cluster that these connections touch stays on the host.

    nengo-loihi replaces clusters by connections that do not learn, and then fails on the error's
    connection to a learning rule that is gone. It also fails if an error passes a node that feeds
    the chip, too, or if a connection that it replaces is probed. It would send the values of
    neurons on the host as spikes.
    """
    return any(
        c in probed
        or c.learning_rule_type is not None
        or isinstance(c.post_obj, LearningRule)
        or sends_values(c, on_chip)
        for c in connections
    )


def sends_values(connection: nengo.Connection, on_chip: Callable[[End], bool]) -> bool:
    """Return whether neurons on the host send values that single spikes cannot stand for.

    These are rates, negative spikes, and several spikes in a step.
    """
    pre = connection.pre_obj
    if not isinstance(pre, Neurons) or on_chip(pre):
        return False
    return not isinstance(pre.ensemble.neuron_type, ONE_SPIKE_A_STEP)


def removable_clusters(scope: Scope) -> Iterator[tuple[Nodes, Connections, Connections]]:
    """Yield each cluster that need not stay, the connections into it, and those out of it."""
    probed = {probe.obj for probe in scope.network.all_probes}
    for cluster, connections in clusters(scope.network):
        if not stays(connections, scope.on_chip, probed):
            into = [c for c in connections if c.pre_obj not in cluster]
            out_of = [c for c in connections if c.post_obj not in cluster]
            yield cluster, into, out_of


def replaced_clusters(scope: Scope) -> Iterator[tuple[Nodes, Connections, Connections]]:
    """Yield each cluster that nengo-loihi replaces, the connections into it, and those out of it.

    These clusters lie between objects on the chip. Every source becomes connected to every target.
    """
    for cluster, into, out_of in removable_clusters(scope):
        before, behind = (c.pre_obj for c in into), (c.post_obj for c in out_of)
        if any(map(scope.on_chip, before)) and any(map(scope.on_chip, behind)):
            yield cluster, into, out_of
