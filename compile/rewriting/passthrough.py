"""The passthrough nodes that matrices can replace, and the order in which to multiply them out.

A cluster of connected passthrough nodes is exactly a matrix from its inputs to its outputs if it
has no loop, nothing in it learns, its transforms are matrices, and no path through it has more than
one synapse: two low-pass filters in a row are not one, so a node between two stays, as a source of
its own. Nengo itself refuses functions of passthrough nodes. A cluster that leads to a learning
rule stays: without it, an ensemble on the chip would itself be a source of errors, which has to be
on the host. A cluster with a probed connection stays too, since a product of matrices has no place
to probe.
"""

from collections import defaultdict
from collections.abc import Container
from graphlib import CycleError, TopologicalSorter

import nengo
from nengo.base import NengoObject
from nengo.connection import LearningRule

from spikeport.compile.ground.clusters import Connections, Nodes, clusters, sends_values
from spikeport.compile.ground.names import End
from spikeport.compile.ground.scope import Scope

DENSE = (nengo.Dense, nengo.transforms.NoTransform)


def foldable(scope: Scope) -> list[nengo.Node]:
    """Return the passthrough nodes that matrices can replace, sources first.

    A cluster that touches no object on the chip stays, and one that sums values of neurons on the
    host, which their spikes cannot stand for.
    """
    probed = {probe.obj for probe in scope.network.all_probes}
    order: list[nengo.Node] = []
    for cluster, connections in clusters(scope.network):
        ends = [end for c in connections for end in (c.pre_obj, c.post_obj) if end not in cluster]
        summed = any(sends_values(c, scope.on_chip) for c in connections)
        if any(map(scope.on_chip, ends)) and not summed:
            order += _order(cluster, connections, probed)
    return order


def _order(
    cluster: Nodes, connections: Connections, probed: Container[NengoObject]
) -> list[nengo.Node]:
    """Return the nodes of a cluster that a matrix can replace, sources first."""
    if not all(_is_matrix(c) and c not in probed for c in connections):
        return []
    into, filtered = defaultdict(list), set()
    for c in connections:
        into[c.post_obj].append(c)
        if c.synapse is not None:
            filtered.add(c.pre_obj)
    sorter = TopologicalSorter(
        {n: [c.pre_obj for c in into[n] if c.pre_obj in cluster] for n in cluster}
    )
    try:
        order = list(sorter.static_order())
    except CycleError:
        return []
    found: list[nengo.Node] = []
    behind_filter: set[End] = set()
    for node in order:
        comes_filtered = any(
            c.synapse is not None or c.pre_obj in behind_filter for c in into[node]
        )
        if comes_filtered and node in filtered:
            continue
        found.append(node)
        if comes_filtered:
            behind_filter.add(node)
    return found


def _is_matrix(connection: nengo.Connection) -> bool:
    learns = connection.learning_rule_type is not None
    teaches = isinstance(connection.post_obj, LearningRule)
    return not learns and not teaches and isinstance(connection.transform, DENSE)
