"""Wire single decoded connections another way; everything else stays."""

from collections.abc import Mapping
from typing import Any

import nengo
import numpy as np
import scipy.sparse as sparse

from spikeport.compile.rewriting.decode_cost import Link
from spikeport.compile.rewriting.flat import Flat
from spikeport.compile.rewriting.relay import RELAYS
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.rewriting.solved import Solved, transform_of

FUNCTION = ("function", "eval_points", "scale_eval_points", "solver")


def link(connection: nengo.Connection, solved: Solved) -> Link:
    """A connection's decoders, of values in units of the target's radius, and its encoders."""
    post = connection.post_obj
    weights = sparse.coo_array(solved.weights(connection) / post.radius)
    rows = np.arange(post.size_in)[connection.post_slice][weights.row]
    shape = (post.size_in, weights.shape[1])
    decoders = sparse.coo_array((weights.data, (rows, weights.col)), shape=shape)
    built = solved.ensemble(post)
    leak_s = getattr(post.neuron_type, "tau_rc", 1.0)  # without leak a neuron integrates as it is
    return Link(
        sparse.csr_array(decoders), sparse.csr_array(built.encoders), jumps=built.gain / leak_s
    )


def rewire(rewrite: Rewrite, chosen: Mapping[nengo.Connection, str], solved: Solved) -> Rewrite:
    """Wire each of some connections along the path that was chosen for it."""
    network = rewrite.network
    flat = Flat(network, solved.seeds)
    for obj in (*network.all_ensembles, *network.all_nodes):
        flat.keep(obj)
    gone = [c for c, path in chosen.items() if path not in RELAYS]
    for connection in network.all_connections:
        path = chosen.get(connection)
        if path == "direct":
            _direct(connection, flat, solved)
        elif path == "host":
            _over_host(connection, flat, solved)
        else:
            flat.keep(connection)
            if path is not None:
                flat.network.config[connection].decode_path = path
    for probe in network.all_probes:
        flat.keep(probe)
    return rewrite.then(flat.network, {}, {c: solved.built(c) for c in gone}, flat.seeds)


def _direct(connection: nengo.Connection, flat: Flat, solved: Solved) -> None:
    """From neuron to neuron: W = E T D."""
    decoders, encoders, _ = link(connection, solved)
    pre = connection.pre_obj
    with flat.network:
        wired = nengo.Connection(
            pre.neurons if isinstance(pre, nengo.Ensemble) else pre,
            connection.post_obj.neurons,
            transform=transform_of(sparse.csr_array(encoders @ decoders)),
            synapse=connection.synapse,
        )
    flat.network.config[wired].decode_path = "direct"


def _over_host(connection: nengo.Connection, flat: Flat, solved: Solved) -> None:
    """The host decodes, and encodes again."""
    decoded: dict[str, Any] = {}
    if isinstance(connection.pre_obj, nengo.Ensemble):
        decoded = {name: getattr(connection, name) for name in FUNCTION}
    with flat.network:
        node = nengo.Node(lambda _t, x: x, size_in=connection.size_out)
        into = nengo.Connection(
            connection.pre,
            node,
            transform=connection.transform,
            synapse=connection.synapse,
            **decoded,
        )
        whole = np.eye(connection.post_obj.size_in)[:, connection.post_slice]
        nengo.Connection(node, connection.post_obj, transform=whole, synapse=None)
    flat.inherit(into, connection)
