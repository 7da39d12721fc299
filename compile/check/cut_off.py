"""Rule SP421: values that the host sends into neurons on the chip, and cuts off.

    sent = clip(value, -w, w)          w = 1, or the weight of the pass `sparse_inputs`

ahead of the transform. The largest values are known for nodes with constant output, for some
processes and functions, and for ensembles, whose radius they keep to; passthrough nodes add up.
"""

from collections.abc import Callable, Iterator

import nengo
import numpy as np
from nengo.ensemble import Neurons

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.clusters import replaced_clusters
from spikeport.compile.ground.names import End
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import (
    Scope,
    full_weights,
    is_passthrough,
    same,
    source_rows,
    target_rows,
)

WITHIN_1 = (np.sin, np.cos, np.tanh)
"""Functions whose values are known to be within 1."""
WITHIN_DATA = ("zero", "nearest", "linear", "slinear")
"""Interpolations of `nengo.processes.Piecewise` between values that stay within them."""
UNKNOWN = np.inf
ROUNDING = 1e-9


def cut_off_hints(
    users: nengo.Network, rewrite: Rewrite, remove_passthrough: bool
) -> Iterator[Violation]:
    """Yield a hint on each connection of values into neurons on the chip that may be cut off.

    Parameters
    ----------
    users : nengo.Network
        The network as the user wrote it.
    rewrite : Rewrite
        The network as it is built: passes may multiply out nodes between a source and neurons.
    remove_passthrough : bool
        nengo-loihi replaces passthrough nodes, and sends the values of their sources.
    """
    most = rewrite.input_weight or 1.0
    largest = _Largest(rewrite.network)
    for connection in dict.fromkeys(_senders(users, rewrite.scope, remove_passthrough)):
        value = largest.sent(connection)
        if value > most * (1 + ROUNDING):
            used = "not known before a run" if value == UNKNOWN else f"up to {value:.4g}"
            yield rules.get("SP421").broken(rewrite.names[connection], used, f"{most:g}")


def _senders(
    users: nengo.Network, scope: Scope, remove_passthrough: bool
) -> Iterator[nengo.Connection]:
    """Yield the connections whose values the host sends to neurons on the chip."""
    behind: dict[End, list[nengo.Connection]] = {}
    if remove_passthrough:
        for cluster, into, _ in replaced_clusters(scope):
            behind.update(dict.fromkeys(cluster, into))
    written = set(users.all_nodes)
    for connection in scope.network.all_connections:
        pre, post = connection.pre_obj, connection.post_obj
        # Passes sum the values for an ensemble, in units of its radius, in a node of their own.
        summed = is_passthrough(pre) and pre not in written
        if isinstance(post, Neurons) and scope.on_chip(post) and not summed:
            found = behind.get(pre, [connection])
            yield from (c for c in found if _sends_values(c, scope))


def _sends_values(connection: nengo.Connection, scope: Scope) -> bool:
    pre = connection.pre_obj
    return not scope.on_chip(pre) and not isinstance(pre, Neurons) and not full_weights(connection)


class _Largest:
    """The largest absolute values in a network; `UNKNOWN`, which is infinite, where not known."""

    def __init__(self, network: nengo.Network) -> None:
        self._into: dict[End, list[nengo.Connection]] = {}
        for connection in network.all_connections:
            self._into.setdefault(connection.post_obj, []).append(connection)
        self._known: dict[nengo.Node, np.ndarray] = {}

    def sent(self, connection: nengo.Connection) -> float:
        """Return the largest value of a connection, ahead of its transform."""
        weights = np.atleast_2d(_weights(connection))
        return float(self._values(connection)[weights.any(axis=0)].max(initial=0.0))

    def _values(self, connection: nengo.Connection) -> np.ndarray:
        """Return the largest values of a connection ahead of its transform, (size_mid,)."""
        pre, size = connection.pre_obj, connection.size_mid
        if isinstance(connection.function, np.ndarray):  # values at evaluation points
            targets: np.ndarray = abs(connection.function).max(axis=0)
            return targets
        if connection.function is not None:
            return np.full(size, _most(connection.function))
        if isinstance(pre, nengo.Node):
            read: np.ndarray = self._outputs(pre)[source_rows(connection)]
            return read
        exact = isinstance(getattr(pre, "neuron_type", None), nengo.Direct)
        known = isinstance(pre, nengo.Ensemble) and not exact
        return np.full(size, pre.radius if known else UNKNOWN)

    def _outputs(self, node: nengo.Node) -> np.ndarray:
        """Return the largest values of a node, (size_out,)."""
        if node not in self._known:
            # A node in a loop finds itself unknown.
            self._known[node] = np.full(node.size_out, UNKNOWN)
            if is_passthrough(node) or node.output is same:
                self._known[node] = self._summed(node)
            else:
                self._known[node] = _outputs(node.output, node.size_out)
        return self._known[node]

    def _summed(self, node: nengo.Node) -> np.ndarray:
        summed = np.zeros(node.size_in)
        for connection in self._into.get(node, []):
            weights, values = _weights(connection), self._values(connection)
            # An unknown value times zero is zero.
            product = np.zeros(weights.shape)
            np.multiply(weights, values, out=product, where=weights > 0)
            sums = product if weights.ndim == 1 else product.sum(axis=1)
            np.add.at(summed, target_rows(connection), sums)
        return summed


def _weights(connection: nengo.Connection) -> np.ndarray:
    """Return a transform without signs: factors, or a matrix; `UNKNOWN` if it is not known yet."""
    transform = connection.transform
    if isinstance(transform, nengo.transforms.NoTransform):
        return np.ones(connection.size_mid)
    if isinstance(transform, nengo.Dense) and isinstance(transform.init, np.ndarray):
        # A factor for each value is kept as such: a matrix of as many rows could be large.
        whole = transform.init.ndim == 2
        found = abs(transform.init)
        return found if whole else np.broadcast_to(found, connection.size_mid)
    return np.full((connection.size_out, connection.size_mid), UNKNOWN)


def _outputs(output: Callable[..., object] | nengo.Process | np.ndarray, size: int) -> np.ndarray:
    """Return the largest values of a node with some output, (size,)."""
    if isinstance(output, np.ndarray):
        return np.broadcast_to(abs(output), size)
    if isinstance(output, nengo.processes.PresentInput):
        largest: np.ndarray = abs(output.inputs).reshape(len(output.inputs), -1).max(axis=0)
        return largest
    if isinstance(output, nengo.processes.Piecewise) and output.interpolation in WITHIN_DATA:
        values = list(output.data.values())
        if not any(callable(value) for value in values):
            return np.broadcast_to(np.abs(values).max(axis=0), size)
    return np.full(size, _most(output))


def _most(function: object) -> float:
    """Return the largest value of a function."""
    return 1.0 if any(function is one for one in WITHIN_1) else UNKNOWN
