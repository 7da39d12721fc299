"""Groups of neurons that become one ensemble each, and the place of every neuron in them."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import nengo


class Part(NamedTuple):
    """A range of neurons of one ensemble."""

    ensemble: nengo.Ensemble
    start: int
    stop: int

    @property
    def size(self) -> int:
        """The number of neurons."""
        return self.stop - self.start


class Position(NamedTuple):
    """The position of a part: its group, and its first neuron and dimension in that group."""

    part: Part
    group: int
    neuron: int
    dimension: int


class Partition:
    """A division of neurons into groups of parts, each to become one ensemble.

    The neurons of a group follow each other part by part, and so do its dimensions: each part has
    dimensions of its own.

    Parameters
    ----------
    groups : iterable of sequences of Part
        The parts of each group, in order.

    Attributes
    ----------
    groups : list of tuples of Part
        The parts of each group.
    places : dict of nengo.Ensemble to list of Position
        The places of the parts of each ensemble, in the order of the groups.
    n_neurons, dimensions : list of int
        The numbers of neurons and of dimensions of each group: the sums over its parts.
    radius : list of float
        The largest radius of each group's ensembles.
    """

    def __init__(self, groups: Iterable[Sequence[Part]]) -> None:
        self.groups = [tuple(group) for group in groups]
        self.places: dict[nengo.Ensemble, list[Position]] = {}
        # Computed once, since Nengo's parameters are slow to read.
        self.n_neurons: list[int] = []
        self.dimensions: list[int] = []
        self.radius: list[float] = []
        for number, group in enumerate(self.groups):
            neuron = dimension = 0
            for part in group:
                place = Position(part, number, neuron, dimension)
                self.places.setdefault(part.ensemble, []).append(place)
                neuron += part.size
                dimension += int(part.ensemble.dimensions)
            self.n_neurons.append(neuron)
            self.dimensions.append(dimension)
            self.radius.append(max(float(part.ensemble.radius) for part in group))

    def __contains__(self, obj: object) -> bool:
        return obj in self.places


def in_parts(ensembles: Sequence[nengo.Ensemble], most: float) -> list[list[Part]]:
    """Lay ensembles end to end into groups of at most ``most`` neurons.

    A larger ensemble is cut into the fewest parts of nearly equal size, each a group of its own.

    Parameters
    ----------
    ensembles : sequence of nengo.Ensemble
        The ensembles, in order.
    most : float
        The most neurons of a group, maybe infinite.
    """
    groups: list[list[Part]] = []
    room = 0.0
    for ensemble in ensembles:
        n_parts = max(1, math.ceil(ensemble.n_neurons / most))  # without limit, ceil(0)
        ends = [ensemble.n_neurons * i // n_parts for i in range(n_parts + 1)]
        for part in (Part(ensemble, *pair) for pair in pairwise(ends)):
            if part.size > room or n_parts > 1:
                groups.append([])
                room = most
            groups[-1].append(part)
            # No other ensemble joins a part: its decoded value is a sum over several groups.
            room = room - part.size if n_parts == 1 else 0
    return groups
