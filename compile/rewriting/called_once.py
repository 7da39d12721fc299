"""Functions of connections from the host, each called once in a step.

nengo-loihi replaces passthrough nodes between ensembles on the chip by connections from every
source to every target. A function of a source is then called once for each target, and one that has
a state, as an integrator, runs as many times as fast.
"""

from collections import defaultdict
from collections.abc import Container, Iterator, Mapping

import nengo

from spikeport.compile.ground.clusters import replaced_clusters
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import Scope, is_called, is_passthrough
from spikeport.compile.loihi.solver import FLOAT, ParameterSolver
from spikeport.compile.rewriting.flat_network import FlatNetwork


def called_once(rewrite: Rewrite, dt_s: float) -> Rewrite:
    """Give each function before passthrough nodes that nengo-loihi replaces a node of its own.

    A network without such functions is returned as it is.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    dt_s : float
        The time step, in seconds.
    """
    found = dict.fromkeys(_multiplied(rewrite.scope))
    if not found:
        return rewrite
    solver = ParameterSolver(rewrite, dt_s, FLOAT)

    def connect(connection: nengo.Connection, flat: FlatNetwork) -> None:
        if connection not in found:
            flat.keep(connection)
            return
        with flat.network:
            node = flat.computed(connection, rewrite.names[connection])
            # A seed decides the values of a transform that is drawn, and the sizes stay the same.
            passed = nengo.Connection(
                node,
                connection.post,
                synapse=connection.synapse,
                transform=connection.transform,
                label=connection.label,
            )
        flat.inherit(passed, connection)

    flat = FlatNetwork.rewired(rewrite.network, solver.seeds, connect)
    return rewrite.then(flat.network, flat.seeds, built={c: solver.built(c) for c in found})


def _multiplied(scope: Scope) -> Iterator[nengo.Connection]:
    """Yield the connections whose function nengo-loihi would call several times in a step."""
    probed = {probe.obj for probe in scope.network.all_probes}
    for cluster, into, _ in replaced_clusters(scope):
        ahead: dict[object, list[nengo.Connection]] = defaultdict(list)
        for c in scope.network.all_connections:
            if c.pre_obj in cluster:
                ahead[c.pre_obj].append(c)
        for c in filter(is_called, into):
            if _is_read_again(c.post_obj, ahead, probed):
                yield c


def _is_read_again(
    node: nengo.Node, ahead: Mapping[object, list[nengo.Connection]], probed: Container[object]
) -> bool:
    """Return whether several paths lead from a node to probes and out of its cluster.

    nengo-loihi makes a connection for each path, not for each target.
    """
    found = 0
    waiting: list[tuple[nengo.Node, tuple[nengo.Node, ...]]] = [(node, (node,))]
    while waiting and found < 2:
        at, path = waiting.pop()
        found += at in probed
        for c in ahead[at]:
            if not is_passthrough(c.post_obj):
                found += 1
            elif c.post_obj not in path:  # nengo-loihi keeps clusters with a loop
                waiting.append((c.post_obj, (*path, c.post_obj)))
    return found > 1
