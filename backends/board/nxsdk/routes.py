"""Routes from the sources of axons to the groups of synapses that the axons reach."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.nxsdk.groups import Group
from spikeport.backends.board.nxsdk.recording import Contact, Core
from spikeport.backends.board.nxsdk.written import AxonMap
from spikeport.compile.image.tables import NONE, OutAxons, Routes, flat, offsets

Place = tuple[int, int]
"""A group, and the number of an axon in it."""


class Routed(NamedTuple):
    """The tables of routes."""

    routes: Routes
    out_axons: OutAxons


class _Source(NamedTuple):
    """A block or an input: its number, its size, and the contacts that its spikes reach."""

    from_input: bool
    number: int
    size: int
    contacts: Iterable[Contact]


class _Route(NamedTuple):
    """A route of a source to a group: the axon and atom of each compartment."""

    source: _Source
    group: int
    axon: np.ndarray
    atom: np.ndarray


def routes_of(cores: Sequence[Core], groups: Sequence[Group], inputs: Sequence[AxonMap]) -> Routed:
    """Return the tables of routes.

    Parameters
    ----------
    cores : sequence of Core
        The registers, with the axons that leave each core.
    groups : sequence of Group
        The groups of synapses of all cores.
    inputs : sequence of AxonMap
        The axons that the host's sources reach.
    """
    places = {
        (*cores[group.core].ids, axon.number): (g, a)
        for g, group in enumerate(groups)
        for a, axon in enumerate(group.axons)
    }
    sources = [
        _Source(False, i, len(core.compartments), core.contacts) for i, core in enumerate(cores)
    ]
    sources += [_Source(True, i, len(axons), _contacts(axons)) for i, axons in enumerate(inputs)]
    routes = [route for source in sources for route in _routes(source, places)]
    return Routed(
        Routes(
            from_input=np.array([route.source.from_input for route in routes], dtype=int),
            source=np.array([route.source.number for route in routes], dtype=int),
            group=np.array([route.group for route in routes], dtype=int),
            start=offsets(route.source.size for route in routes),
        ),
        OutAxons(
            axon=flat([route.axon for route in routes]),
            atom=flat([route.atom for route in routes]),
        ),
    )


def _routes(source: _Source, places: Mapping[tuple[int, int, int], Place]) -> list[_Route]:
    """Return the routes of a source: n routes to a group that it reaches by n axons."""
    made: dict[Place, _Route] = {}
    taken: dict[Place, int] = {}
    for contact in source.contacts:
        group, axon = places[contact.chip_id, contact.core_id, contact.axon]
        nth = taken[contact.compartment, group] = taken.get((contact.compartment, group), -1) + 1
        if (group, nth) not in made:
            nowhere = np.full(source.size, NONE)
            made[group, nth] = _Route(source, group, nowhere, np.zeros(source.size, dtype=int))
        made[group, nth].axon[contact.compartment] = axon
        made[group, nth].atom[contact.compartment] = contact.atom
    return [made[key] for key in sorted(made)]


def _contacts(axons: AxonMap) -> Iterable[Contact]:
    """Yield the axons that the sources of an input reach."""
    for source, reached in axons.items():
        for axon in reached:
            place = (int(axon[name]) for name in ("chip_id", "core_id", "axon_id", "atom"))
            yield Contact(int(source), *place)
