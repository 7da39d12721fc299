"""Functions of connections from the host, each called once in a step.

nengo-loihi replaces passthrough nodes between ensembles on the chip by connections from every
source to every target. A function of a source is then called once for each target, and one that has
a state, as an integrator, runs as many times as fast.
"""

from collections.abc import Iterator

import nengo

from spikeport.compile.ground.clusters import replaced_clusters
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import Scope, is_called
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
    for cluster, into, out_of in replaced_clusters(scope):
        if len(out_of) + len(probed & cluster.keys()) > 1:
            yield from filter(is_called, into)
