"""Connections to a part of an ensemble on the chip, as connections to the whole ensemble.

    W' = S W R^T,   S[rows[i], i] += 1,   R[sources[j], j] += 1

nengo-loihi only builds axons to whole targets, and one axon for each neuron of a source. An
entry that occurs twice in a slice receives or sends the sum, as in Nengo.
"""

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.ensemble import Neurons

from spikeport.compile.ground.matrices import full, placed
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import in_full, target_rows
from spikeport.compile.loihi.solver import ParameterSolver, nengo_transform
from spikeport.compile.rewriting.flat_network import FlatNetwork, start, sums_up


def whole_targets(rewrite: Rewrite, dt_s: float) -> Rewrite:
    """Connect to whole ensembles wherever a connection ends in a part of an ensemble on the chip.

    A connection whose slice has a neuron of its source more than once reads the whole source. Float
    behaviour stays equal, up to rounding. A network without such connections is returned as it is.

    Parameters
    ----------
    rewrite : Rewrite
        The network; no convolution in it ends in a part of an ensemble.
    dt_s : float
        The time step, in seconds.

    Raises
    ------
    RefusedError
        If nengo-loihi's builder refuses one of the connections, or its ensemble.
    """
    network = rewrite.network
    scope = rewrite.scope
    parts = {c for c in network.all_connections if scope.repeats_spikes(c) or scope.reaches_part(c)}
    if not parts:
        return rewrite
    solver = ParameterSolver(rewrite, dt_s)

    def connect(connection: nengo.Connection, flat: FlatNetwork) -> None:
        if connection in parts:
            _connect_whole(connection, flat, solver)
        else:
            flat.keep(connection)

    flat = FlatNetwork.rewired(network, solver.seeds, connect)
    # The decoders of an ensemble on the host are solved later, by Nengo's own builder.
    known = [c for c in parts if not isinstance(c.pre_obj, nengo.Ensemble) or scope.on_chip(c.pre)]
    return rewrite.then(flat.network, flat.seeds, built={c: solver.built(c) for c in known})


def _connect_whole(
    connection: nengo.Connection, flat: FlatNetwork, solver: ParameterSolver
) -> None:
    """Replace a connection to a part of a target by a connection to the whole target.

    If the slice of the source has an entry twice, the new connection reads the whole source.
    """
    pre, options = start(connection)
    with flat.network:
        whole = nengo.Connection(
            pre,
            connection.post_obj,
            synapse=connection.synapse,
            transform=_whole_transform(connection, solver),
            label=connection.label,
            **options,
        )
    flat.inherit(whole, connection)
    flat.configure(whole, connection)


def _whole_transform(
    connection: nengo.Connection, solver: ParameterSolver
) -> nengo.transforms.Transform | np.ndarray:
    adds = sums_up(connection)
    if in_full(connection) and not adds:
        return connection.transform
    weights = solver.weights(connection) if adds else solver.transform(connection)
    weights = full(weights, connection.size_mid)
    matrix = placed(weights, target_rows(connection), connection.post_obj.size_in)
    between_neurons = isinstance(connection.pre_obj, Neurons) and isinstance(
        connection.post_obj, Neurons
    )
    # Rows of zeros would be stored with each neuron's synapses; elsewhere weights must be dense.
    return nengo_transform(sparse.csr_array(matrix)) if between_neurons else matrix
