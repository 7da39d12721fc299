"""A lower bound on the compartments of a network whose connections are not rewritten.

nengo-loihi gives every decoded connection between ensembles on the chip decode neurons of its own.
Neurons are counted without building anything: a passthrough node between m ensembles and n others
stands for up to m n connections, and decoders would be solved for each.
"""

from collections import defaultdict

import nengo
import numpy as np
import scipy.sparse as sparse

from spikeport.compile.ground.scope import (
    Scope,
    full_weights,
    source_rows,
    target_rows,
)
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.compile.loihi.merged_connections import ROUNDING
from spikeport.compile.loihi.relay import RELAYS
from spikeport.compile.rewriting.passthrough import foldable


def compartments_at_least(scope: Scope, build: BuildSettings = AS_USUAL) -> int:
    """Return a lower bound on the compartments of a network: its neurons and decode neurons.

    Read-outs, connections through nodes that nengo-loihi may keep, and connections whose path the
    user chose are left out.
    """
    neurons: int = sum(ensemble.n_neurons for ensemble in scope.ensembles)
    nodes = foldable(scope) if build.remove_passthrough else []
    return neurons + neurons_per_value(build) * _relayed_values(scope, nodes)


def neurons_per_value(build: BuildSettings) -> int:
    """Return the number of decode neurons for each value that a connection carries.

    It is 0 for decode neurons of a user's class, whose number is not known.
    """
    neurons = RELAYS["preset10"]() if build.decode_neurons is None else build.decode_neurons
    return 2 * int(getattr(neurons, "pairs_per_dim", 0))


def _relayed_values(scope: Scope, nodes: list[nengo.Node]) -> int:
    """Return the number of values of all decoded connections between ensembles on the chip.

    ``nodes`` are the passthrough nodes that connections replace, sources first.
    """
    connections = dict.fromkeys(scope.network.all_connections)
    leaving = defaultdict(list)
    for connection in connections:
        leaving[connection.pre_obj].append(connection)
    settings = NetworkSettings(scope.network)
    values: int = sum(
        connection.size_out
        for connection in connections
        if scope.on_chip(connection.pre_obj)
        and scope.on_chip(connection.post_obj)
        and _is_relayed(connection)
        # A path that the user chose may take no decode neurons, such as the direct one.
        and settings.get(connection, "decode_path") is None
    )
    sources, among = _Sources(nodes, scope), set(nodes)
    for node in nodes:
        for connection in leaving[node]:
            if connection.post_obj in among:
                sources.pass_on(connection)
            elif _is_relayed(connection) and scope.on_chip(connection.post_obj):
                values += connection.size_out * sources.count(connection)
    return values


def _is_relayed(connection: nengo.Connection) -> bool:
    """Return whether the values of a connection are decoded, and encoded again at an ensemble."""
    return isinstance(connection.post_obj, nengo.Ensemble) and not full_weights(connection)


class _Sources:
    """The values that reach passthrough nodes, as matrices from connections that start on the chip.

    The matrices of a node lie side by side, with the number of the connection that each column
    belongs to.
    """

    def __init__(self, nodes: list[nengo.Node], scope: Scope) -> None:
        self._matrices: dict[nengo.Node, list[sparse.csr_array]] = {node: [] for node in nodes}
        self._numbers: dict[nengo.Node, list[np.ndarray]] = {node: [] for node in nodes}
        for number, connection in enumerate(dict.fromkeys(scope.network.all_connections)):
            if connection.post_obj in self._matrices and scope.on_chip(connection.pre_obj):
                matrix = _into_whole(connection)
                self._add(connection.post_obj, matrix, np.full(matrix.shape[1], number))

    def _add(self, node: nengo.Node, matrix: sparse.csr_array, numbers: np.ndarray) -> None:
        self._matrices[node].append(matrix)
        self._numbers[node].append(numbers)

    def _at(self, node: nengo.Node) -> tuple[sparse.csr_array, np.ndarray]:
        """Join the matrices of a node to one, and return it with the numbers of its columns."""
        empty = sparse.csr_array((node.size_in, 0))
        matrix = sparse.csr_array(sparse.hstack(self._matrices[node] or [empty]))
        numbers = np.concatenate([np.zeros(0, dtype=int), *self._numbers[node]])
        self._matrices[node], self._numbers[node] = [matrix], [numbers]
        return matrix, numbers

    def pass_on(self, connection: nengo.Connection) -> None:
        """Add what a connection takes from one passthrough node to another."""
        matrix, numbers = self._at(connection.pre_obj)
        passed = _into_whole(connection) @ matrix[source_rows(connection)]
        self._add(connection.post_obj, passed, numbers)

    def count(self, connection: nengo.Connection) -> int:
        """Return how many connections from the chip reach a target through one from a node."""
        matrix, numbers = self._at(connection.pre_obj)
        passed = sparse.coo_array(_transform(connection) @ matrix[source_rows(connection)])
        # Products that are only rounding are left out of the build, too.
        return len(np.unique(numbers[passed.col[np.abs(passed.data) > ROUNDING]]))


def _into_whole(connection: nengo.Connection) -> sparse.csr_array:
    """Return a connection as a matrix into all of its target, (target size, values)."""
    rows, size = target_rows(connection), connection.post_obj.size_in
    at = (np.ones(len(rows)), (rows, np.arange(len(rows))))
    return sparse.csr_array(at, (size, len(rows))) @ _transform(connection)


def _transform(connection: nengo.Connection) -> sparse.csr_array:
    """Return a transform as a matrix; ones if it is drawn at random, as it carries every value.

    It is sparse: as dense ones, m factors from each of m sources would take the third power of m.
    """
    init = np.asarray(getattr(connection.transform, "init", 1.0))
    if init.dtype == object:
        init = np.ones((connection.size_out, connection.size_mid))
    if init.ndim == 2:
        return sparse.csr_array(init)
    return sparse.csr_array(sparse.diags_array(np.broadcast_to(init, connection.size_mid)))
