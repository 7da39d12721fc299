"""Rule SP421: values that the host sends into neurons on the chip, and cuts off.

    sent = clip(value, -w, w)          w = 1, or the weight of the pass `sparse_inputs`

ahead of the transform. The largest values are known for nodes with constant output, for some
processes and functions, and for ensembles, whose radius they keep to; passthrough nodes add up.
"""

from collections.abc import Callable, Container, Iterator
from typing import TypeAlias

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
Into: TypeAlias = dict[End, list[nengo.Connection]]
"""The connections that end on each object."""
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
    into: Into = {}
    for connection in rewrite.network.all_connections:
        into.setdefault(connection.post_obj, []).append(connection)
    largest = _Largest(into)
    for connection in dict.fromkeys(_senders(users, rewrite.scope, into, remove_passthrough)):
        value = largest.sent(connection)
        if value > most * (1 + ROUNDING):
            used = "not known before a run" if value == UNKNOWN else f"up to {value:.4g}"
            yield rules.get("SP421").broken(rewrite.names[connection], used, f"{most:g}")


def _senders(
    users: nengo.Network, scope: Scope, into: Into, remove_passthrough: bool
) -> Iterator[nengo.Connection]:
    """Yield the connections whose values the host sends to neurons on the chip."""
    replaced: set[End] = set()
    if remove_passthrough:
        replaced.update(*(cluster for cluster, *_ in replaced_clusters(scope)))
    written = set(users.all_nodes)
    for connection in scope.network.all_connections:
        pre, post = connection.pre_obj, connection.post_obj
        # Passes sum the values for an ensemble, in units of its radius, in a node of their own.
        summed = is_passthrough(pre) and pre not in written
        if isinstance(post, Neurons) and scope.on_chip(post) and not summed:
            found = _ahead(connection, into, replaced) if pre in replaced else [connection]
            yield from (c for c in found if _sends_values(c, scope))


def _ahead(
    connection: nengo.Connection, into: Into, replaced: Container[End]
) -> Iterator[nengo.Connection]:
    """Yield the connections into a cluster of nodes whose values a connection out of it sends."""
    read = {connection.pre_obj: _read(connection, np.ones(connection.size_out, dtype=bool))}
    waiting = [connection.pre_obj]
    while waiting:
        node = waiting.pop()
        for one in into.get(node, ()):
            targets = read[node][target_rows(one)]
            if not targets.any():
                continue
            values = _read(one, targets)
            if one.pre_obj not in replaced:
                if values.any():
                    yield one
                continue
            before = read.get(one.pre_obj, np.zeros_like(values))
            if (values & ~before).any():
                read[one.pre_obj] = before | values
                waiting.append(one.pre_obj)


def _read(connection: nengo.Connection, targets: np.ndarray) -> np.ndarray:
    """Return which values of its source a connection sends to some of its targets, (size_out,)."""
    weights = _weights(connection) > 0
    sent = weights & targets if weights.ndim == 1 else weights[targets].any(axis=0)
    read = np.zeros(connection.pre_obj.size_out, dtype=bool)
    # A slice may have an entry twice.
    np.logical_or.at(
        read, source_rows(connection), sent if connection.function is None else sent.any()
    )
    return read


def _sends_values(connection: nengo.Connection, scope: Scope) -> bool:
    pre = connection.pre_obj
    return not scope.on_chip(pre) and not isinstance(pre, Neurons) and not full_weights(connection)


class _Largest:
    """The largest absolute values in a network; `UNKNOWN`, which is infinite, where not known."""

    def __init__(self, into: Into) -> None:
        self._into = into
        self._known: dict[nengo.Node, np.ndarray] = {}

    def sent(self, connection: nengo.Connection) -> float:
        """Return the largest value of a connection, ahead of its transform."""
        if isinstance(connection.pre_obj, nengo.Node):
            self._learn(connection.pre_obj)
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
            # A node in a loop finds itself unknown.
            known = self._known.get(pre, np.full(pre.size_out, UNKNOWN))
            read: np.ndarray = known[source_rows(connection)]
            return read
        exact = isinstance(getattr(pre, "neuron_type", None), nengo.Direct)
        within = isinstance(pre, nengo.Ensemble) and not exact
        return np.full(size, pre.radius if within else UNKNOWN)

    def _learn(self, node: nengo.Node) -> None:
        """Find the largest values (size_out,) of a node, and of those that it sums, ahead of it."""
        # Not recursive: a chain of nodes may be longer than Python's stack.
        found, begun = [node], set()
        while found:
            last = found[-1]
            summed = [c.pre_obj for c in self._into.get(last, ())] if _sums(last) else []
            nodes = [one for one in summed if isinstance(one, nengo.Node)]
            ahead = [one for one in nodes if one not in self._known]
            if last not in begun and ahead:
                begun.add(last)
                found += [one for one in ahead if one not in begun]
                continue
            found.pop()
            if last not in self._known:
                own = self._summed(last) if _sums(last) else _outputs(last.output, last.size_out)
                self._known[last] = own

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


def _sums(node: nengo.Node) -> bool:
    """Return whether a node outputs the sum of its inputs."""
    return is_passthrough(node) or node.output is same


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
