"""The ensembles that may be regrouped, and which are wired alike, by colour refinement."""

import itertools
from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.ensemble import Neurons

from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import (
    MATRICES,
    Scope,
    full_weights,
    is_passthrough,
    is_plain,
    probeable,
)
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.rewriting.passthrough import DENSE

RADII = 8
"""Binary digits of a range of radii that may share an ensemble, such as that from 1/16 to 16."""


def regroupable(scope: Scope, folded: Sequence[nengo.Node]) -> list[nengo.Ensemble]:
    """Return the ensembles on the chip whose neurons may become part of other ensembles.

    An ensemble is left out if it learns, or has a block shape, a transform that is not a matrix, or
    a probe of anything other than spikes, state and decoded values. It is also left out if it
    breaks a rule of `spikeport.compile.check.lint`, which has to find it.

    Parameters
    ----------
    scope : Scope
        The network.
    folded : sequence of nengo.Node
        The passthrough nodes that will be multiplied out.
    """
    settings = NetworkSettings(scope.network)
    special = set(_special(scope, folded))
    return [
        ensemble
        for ensemble in scope.ensembles
        if ensemble not in special
        and _has_plain_neurons(ensemble)
        and settings.get(ensemble, "block_shape") is None
    ]


def _has_plain_neurons(ensemble: nengo.Ensemble) -> bool:
    # Nengo refuses gain without bias, and bias without gain: lint reports it.
    both_or_neither = (ensemble.gain is None) == (ensemble.bias is None)
    return is_plain(ensemble.neuron_type) and ensemble.noise is None and both_or_neither


def _special(scope: Scope, folded: Sequence[nengo.Node]) -> Iterator[NengoObject]:
    """Yield the ends of special connections, and the objects of special probes.

    nengo-loihi replaces a passthrough node that stays, so objects around it stay as written, and so
    do those behind folded nodes, which become its targets.
    """
    nodes = (node for node in scope.network.all_nodes if is_passthrough(node))
    staying = set(nodes).difference(folded)
    feeding = _fed_by(staying, folded, scope)
    for connection in scope.network.all_connections:
        ends = (connection.pre_obj, connection.post_obj)
        stays = not staying.isdisjoint(ends) or connection.pre_obj in feeding
        if stays or not _is_ordinary(scope, connection):
            yield from map(base, ends)
    for probe in scope.network.all_probes:
        if probe.attr not in probeable(probe.obj):
            obj = probe.obj
            of_connection = isinstance(obj, nengo.Connection)
            yield from map(base, (obj.pre_obj, obj.post_obj) if of_connection else (obj,))


def _fed_by(
    staying: set[nengo.Node], folded: Sequence[nengo.Node], scope: Scope
) -> set[nengo.Node]:
    """Return the folded nodes that nodes which stay feed, directly or through each other."""
    sources = defaultdict(list)
    for connection in scope.network.all_connections:
        sources[connection.post_obj].append(connection.pre_obj)
    fed: set[nengo.Node] = set()
    for node in folded:  # sources first
        if any(source in staying or source in fed for source in sources[node]):
            fed.add(node)
    return fed


def _is_ordinary(scope: Scope, connection: nengo.Connection) -> bool:
    """Return whether a connection is a matrix and, on the chip, at most a low-pass filter.

    The host decodes what its ensembles send, so full weights of theirs are no matrix to neurons.
    """
    from_chip = scope.on_chip(connection.pre_obj)
    inside = from_chip and scope.on_chip(connection.post_obj)
    between_neurons = inside and isinstance(connection.pre_obj, Neurons)
    matrices = MATRICES if between_neurons else DENSE
    return (
        connection.learning_rule_type is None
        and isinstance(connection.transform, matrices)
        and (not full_weights(connection) or (from_chip and connection.solver.compositional))
        and (not inside or type(connection.synapse) in (nengo.Lowpass, type(None)))
    )


class _Edge(NamedTuple):
    """A connection as colour refinement sees it; ``kind`` is what equal wiring has in common."""

    pre: NengoObject
    post: NengoObject
    kind: Hashable


def alike(scope: Scope, ensembles: Sequence[nengo.Ensemble]) -> list[list[nengo.Ensemble]]:
    """Return ensembles with equal neurons that are wired alike, by colour refinement.

    Two ensembles are alike if their neuron types are equal, and if the same kinds of connections
    lead from and to objects of the same colours; the kind includes the synapse, the setting
    ``decode_path``, and if a solver returns weights between neurons. Objects of one colour are
    wired alike in turn; the objects that stay have one colour.

    Parameters
    ----------
    scope : Scope
        The network.
    ensembles : sequence of nengo.Ensemble
        The ensembles to group.

    Returns
    -------
    groups : list of lists of nengo.Ensemble
        Groups and their members, in the order of the ensembles.
    """
    colour: dict[NengoObject, int] = dict.fromkeys(scope.network.all_ensembles, 0)
    free: list[NengoObject] = list(ensembles)
    # Passthrough nodes are refined like ensembles, so that ensembles behind them can differ.
    for node in scope.network.all_nodes:
        colour[node] = -1 if is_passthrough(node) else 0
        free += [node] if is_passthrough(node) else []
    colour.update(_numbered({ensemble: neuron_key(ensemble) for ensemble in ensembles}))
    settings = NetworkSettings(scope.network)
    edges = [_edge(connection, settings) for connection in scope.network.all_connections]
    _Refinement(colour, free, edges).run()
    groups = defaultdict(list)
    for ensemble in ensembles:
        groups[colour[ensemble]].append(ensemble)
    return list(groups.values())


def _edge(connection: nengo.Connection, settings: NetworkSettings) -> _Edge:
    pre, post = connection.pre_obj, connection.post_obj
    # Weights between neurons filter in the target's own compartments, relays ahead of them.
    wired = full_weights(connection), settings.get(connection, "decode_path")
    kind = (type(pre).__name__, type(post).__name__, repr(connection.synapse), *wired)
    return _Edge(base(pre), base(post), kind)


class _Refinement:
    """The refinement of colours: objects of one colour with different neighbours get new colours.

    Only neighbours of recoloured objects are checked again: in a chain, a few a round.
    """

    def __init__(
        self,
        colour: dict[NengoObject, int],
        free: Sequence[NengoObject],
        edges: Sequence[_Edge],
    ) -> None:
        self._colour, self._free = colour, dict.fromkeys(free)
        self._around: dict[NengoObject, list[tuple[Hashable, NengoObject]]] = defaultdict(list)
        for edge in edges:
            self._around[edge.pre].append((("to", edge.kind), edge.post))
            self._around[edge.post].append((("from", edge.kind), edge.pre))
        self._sizes = Counter(colour[obj] for obj in free)
        self._fresh = itertools.count(1 + max(colour.values(), default=0))

    def run(self) -> None:
        """Refine the colours, in place."""
        odd = list(self._free)
        while odd:
            new = self._recoloured(odd)
            near = (other for obj in new for _, other in self._around[obj])
            odd = [obj for obj in dict.fromkeys(near) if obj in self._free]

    def _recoloured(self, odd: Iterable[NengoObject]) -> list[NengoObject]:
        """Give new colours to objects that differ from others of their colour, and return them."""
        parts: dict[int, dict[Hashable, list[NengoObject]]] = defaultdict(dict)
        for obj in odd:
            parts[self._colour[obj]].setdefault(self._neighbours(obj), []).append(obj)
        new = []
        for old, found in parts.items():
            split = sorted(found.values(), key=len)
            # Each part has a recoloured neighbour, the rest has none. Without a rest, the largest
            # part keeps the colour.
            if sum(map(len, split)) == self._sizes[old]:
                split.pop()
            for part in split:
                self._recolour(part, old)
                new += part
        return new

    def _recolour(self, part: Sequence[NengoObject], old: int) -> None:
        fresh = next(self._fresh)
        self._colour.update(dict.fromkeys(part, fresh))
        self._sizes[old] -= len(part)
        self._sizes[fresh] = len(part)

    def _neighbours(self, obj: NengoObject) -> frozenset[Hashable]:
        # A set, not counts: an ensemble with two inputs of a kind may join one with three.
        around = self._around[obj]
        return frozenset((kind, self._colour.get(other)) for kind, other in around)


def _numbered(keys: Mapping[NengoObject, Hashable]) -> dict[NengoObject, int]:
    """Number objects from 1 by their keys, in order of appearance."""
    numbers: dict[Hashable, int] = {}
    return {obj: numbers.setdefault(key, 1 + len(numbers)) for obj, key in keys.items()}


def neuron_key(ensemble: nengo.Ensemble) -> tuple[Hashable, ...]:
    """Return a key that is equal for neurons that may share an ensemble.

    Values are in units of the largest radius: those of a far smaller one would be rounded away.
    """
    kind = ensemble.neuron_type
    size = round(np.log2(ensemble.radius) / RADII)
    # A fused ensemble keeps the initial state of each neuron.
    names = sorted(name for name in kind._paramdict if name != "initial_state")
    return (size, type(kind), *(repr(getattr(kind, name)) for name in names))
