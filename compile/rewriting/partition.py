"""Which neurons become one ensemble: members wired alike together, too large ones in parts."""

import math
from collections import defaultdict
from collections.abc import Hashable, Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import nengo

from spikeport.compile.names import base
from spikeport.compile.verdict.lint import Scope


class Part(NamedTuple):
    """Neurons of one ensemble, as a range."""

    ensemble: nengo.Ensemble
    start: int
    stop: int

    @property
    def size(self) -> int:
        """The number of neurons."""
        return self.stop - self.start


class Place(NamedTuple):
    """Where a part is: its group, and there its first neuron and dimension."""

    part: Part
    group: int
    neuron: int
    dimension: int


class Partition:
    """Groups of parts, each to become one ensemble.

    Parameters
    ----------
    groups : sequence of sequences of Part
        The parts of each group, in order.
    """

    def __init__(self, groups: Iterable[Sequence[Part]]) -> None:
        self.groups = [tuple(group) for group in groups]
        self.places: dict[nengo.Ensemble, list[Place]] = defaultdict(list)
        for number, group in enumerate(self.groups):
            neuron = dimension = 0
            for part in group:
                self.places[part.ensemble].append(Place(part, number, neuron, dimension))
                neuron += part.size
                dimension += part.ensemble.dimensions

    def __contains__(self, obj: Any) -> bool:
        return obj in self.places

    def n_neurons(self, group: int) -> int:
        """Neurons of a group."""
        return sum(part.size for part in self.groups[group])

    def dimensions(self, group: int) -> int:
        """Dimensions of a group: those of all its members."""
        return sum(part.ensemble.dimensions for part in self.groups[group])

    def radius(self, group: int) -> float:
        """The largest radius of a group's members."""
        return max(part.ensemble.radius for part in self.groups[group])


def in_parts(members: Sequence[nengo.Ensemble], most: float) -> list[list[Part]]:
    """Members laid end to end into groups of at most so many neurons; larger ones cut evenly."""
    groups: list[list[Part]] = []
    room = 0.0
    for member in members:
        n_parts = math.ceil(member.n_neurons / most)
        ends = [member.n_neurons * i // n_parts for i in range(n_parts + 1)]
        for part in (Part(member, *pair) for pair in pairwise(ends)):
            if part.size > room or n_parts > 1:
                groups.append([])
                room = most
            groups[-1].append(part)
            room = room - part.size if n_parts == 1 else 0
    return groups


def alike(scope: Scope, members: Sequence[nengo.Ensemble]) -> list[list[nengo.Ensemble]]:
    """Members with equal neurons that are wired alike, by colour refinement.

    Two members are alike if their neuron types are, and if from and to the same kinds of objects
    the same kinds of connections lead, where kind includes the synapse, and objects are of one kind
    if they in turn are wired alike.
    """
    colour: dict[Any, int] = {}
    mine = set(members)
    for obj in [*scope.network.all_ensembles, *scope.network.all_nodes]:
        folded = isinstance(obj, nengo.Node) and obj.output is None
        colour[obj] = -1 if folded else 0
    colour.update(_number({m: neuron_key(m) for m in members}, 1))
    free = [obj for obj in colour if obj in mine or colour[obj] == -1]
    edges = [_edge(c) for c in scope.network.all_connections]
    while True:
        refined = _refine(colour, free, edges)
        if len(set(refined.values())) == len({colour[obj] for obj in free}):
            break
        colour.update(refined)
    groups = defaultdict(list)
    for member in members:
        groups[colour[member]].append(member)
    return list(groups.values())


def _edge(connection: nengo.Connection) -> tuple[Any, Any, Hashable]:
    kinds = (type(connection.pre_obj).__name__, type(connection.post_obj).__name__)
    return base(connection.pre_obj), base(connection.post_obj), (*kinds, repr(connection.synapse))


def _refine(
    colour: dict[Any, int], free: list[Any], edges: list[tuple[Any, Any, Hashable]]
) -> dict[Any, int]:
    around: dict[Any, set[Hashable]] = defaultdict(set)
    for pre, post, kind in edges:
        around[pre].add(("to", kind, colour.get(post)))
        around[post].add(("from", kind, colour.get(pre)))
    return _number({obj: (colour[obj], frozenset(around[obj])) for obj in free}, 1)


def _number(keys: dict[Any, Hashable], first: int) -> dict[Any, int]:
    """Number the objects by their keys, in order of appearance."""
    seen: dict[Hashable, int] = {}
    return {obj: seen.setdefault(key, first + len(seen)) for obj, key in keys.items()}


def neuron_key(ensemble: nengo.Ensemble) -> tuple[Hashable, ...]:
    """What must be equal of neurons in one ensemble: all but where they start."""
    kind = ensemble.neuron_type
    names = sorted(name for name in kind._paramdict if name != "initial_state")
    return (type(kind), *(repr(getattr(kind, name)) for name in names))
