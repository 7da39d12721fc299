"""The rewiring of single decoded connections; everything else stays."""

from collections.abc import Mapping

import nengo
import numpy as np

from spikeport.compile.ground.matrices import full
from spikeport.compile.ground.names import End
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import same
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.rewriting.flat_network import FlatNetwork, decoding, start, sums_up
from spikeport.compile.rewriting.links import Link


def rewire(
    rewrite: Rewrite,
    chosen: Mapping[nengo.Connection, str],
    links: Mapping[nengo.Connection, Link],
    filters: Mapping[nengo.Ensemble, float],
    solver: ParameterSolver,
) -> Rewrite:
    """Wire some connections along the path that was chosen for each.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    chosen : mapping of nengo.Connection to str
        A path of `spikeport.compile.rewriting.decode_paths` for each of these connections.
    links : mapping of nengo.Connection to Link
        Their decoders and encoders.
    filters : mapping of nengo.Ensemble to float
        The time constant of each target's compartments, in seconds.
    solver : ParameterSolver
        Solves the network's decoders and encoders.
    """

    def connect(connection: nengo.Connection, flat: FlatNetwork) -> None:
        path = chosen.get(connection)
        if path == "direct":
            _connect_directly(connection, flat, links[connection])
        elif path == "host":
            _connect_over_host(connection, flat, solver)
        elif path is None:
            flat.keep(connection)
        else:
            # nengo-loihi builds relays itself, of the kind that the setting names.
            settings = flat.network.config[_relayed(connection, flat, solver)]
            settings.decode_path = path
            settings.target_filter_s = filters[connection.post_obj]

    flat = FlatNetwork.rewired(rewrite.network, solver.seeds, connect)
    kept = set(flat.network.connections)
    gone = [c for c in chosen if c not in kept]
    return rewrite.then(flat.network, flat.seeds, built={c: solver.built(c) for c in gone})


def _connect_directly(connection: nengo.Connection, flat: FlatNetwork, link: Link) -> None:
    """Connect neuron to neuron: W = E T D."""
    pre = connection.pre_obj
    with flat.network:
        wired = nengo.Connection(
            pre.neurons if isinstance(pre, nengo.Ensemble) else pre,
            connection.post_obj.neurons,
            transform=link.transform,
            synapse=connection.synapse,
        )
    flat.network.config[wired].decode_path = "direct"


def _connect_over_host(
    connection: nengo.Connection, flat: FlatNetwork, solver: ParameterSolver
) -> None:
    """Connect to a node on the host, and from the node to the target."""
    with flat.network:
        # The node has a function, the identity: a passthrough node would be removed again.
        node = nengo.Node(same, size_in=connection.size_out)
        into = _without_sparse(connection, node, solver)
        whole = np.eye(connection.post_obj.size_in)[:, connection.post_slice]
        nengo.Connection(node, connection.post_obj, transform=whole, synapse=None)
    flat.inherit(into, connection)


def _relayed(
    connection: nengo.Connection, flat: FlatNetwork, solver: ParameterSolver
) -> nengo.Connection:
    """Keep a relayed connection, or make one like it that nengo-loihi accepts."""
    sparse_one = isinstance(connection.transform, nengo.Sparse)
    if not (sparse_one and isinstance(connection.pre_obj, nengo.Ensemble)):
        flat.keep(connection)
        return connection
    with flat.network:
        like = _without_sparse(connection, connection.post, solver)
    like.label = connection.label
    flat.inherit(like, connection)
    flat.configure(like, connection)
    return like


def _without_sparse(
    connection: nengo.Connection, target: End, solver: ParameterSolver
) -> nengo.Connection:
    """Make a connection like another, to a target, with a dense transform in place of a sparse one.

    nengo-loihi can neither decode with a sparse transform, nor read one from the chip.
    """
    transform = connection.transform
    if isinstance(transform, nengo.Sparse):
        pre, options = start(connection)
        weights = solver.weights if sums_up(connection) else solver.transform
        transform = full(weights(connection), connection.size_mid)
    else:
        pre, options = connection.pre, decoding(connection)
    synapse = connection.synapse
    return nengo.Connection(pre, target, transform=transform, synapse=synapse, **options)
