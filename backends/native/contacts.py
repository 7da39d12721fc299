"""Where the routes of an image lead: *contacts*, one for each atom of an input axon."""

from typing import NamedTuple

import numpy as np

from spikeport.backends.native.rows import Rows, offsets_of
from spikeport.compile.fanout import first_sources
from spikeport.compile.image import ChipImage
from spikeport.errors import ImageError


class Contacts(NamedTuple):
    """Arrays of (n_contacts,)."""

    row: np.ndarray
    """The row of weights each adds."""
    first: np.ndarray
    """The compartment that the row's targets count from."""
    core: np.ndarray
    """The core it is on."""
    used: np.ndarray
    """Whether its axon has a base: spikes that reach one without are not delivered."""


class Pairs(NamedTuple):
    """A source and a contact for each way that a spike can take, in the order of sources."""

    source: np.ndarray
    contact: np.ndarray


def contacts_of(image: ChipImage, rows: Rows) -> Contacts:
    """All contacts of an image.

    Raises
    ------
    ImageError
        If a synapse targets a compartment outside its block.
    """
    group, axon_row = _axons(image)
    start = first_contacts(image)
    axon = np.repeat(np.arange(len(group)), np.diff(start))
    atom = np.arange(len(axon)) - start[axon]
    row = offsets_of(image["row_atoms"])[axon_row[axon]] + atom
    block, base = image["synapse_block"][group[axon]], image["in_axon_base"][axon]
    _check_targets(image, rows, row, base, block)
    return Contacts(row, image["block_start"][block] + base, image["block_core"][block], base >= 0)


def first_contacts(image: ChipImage) -> np.ndarray:
    """(n_axons + 1,) the first contact of each input axon: it has one for each atom of its row."""
    return offsets_of(image["row_atoms"][_axons(image)[1]])


def _axons(image: ChipImage) -> tuple[np.ndarray, np.ndarray]:
    """The group and the row of each input axon."""
    group = np.repeat(np.arange(len(image["synapse_block"])), np.diff(image["in_axon_start"]))
    return group, image["row_start"][group] + image["in_axon_row"]


def pairs_of(image: ChipImage) -> Pairs:
    """Every source with every contact its routes lead to.

    Raises
    ------
    ImageError
        If a route leads to an axon outside its group, or to an atom its row does not have.
    """
    _check_routes(image)
    firsts, start = first_sources(image), first_contacts(image)
    sources, contacts = [np.zeros(0, int)], [np.zeros(0, int)]
    for route, group in enumerate(image["route_synapse"]):
        part = image.part("route_start", route)
        used = np.flatnonzero(image["route_axon"][part] >= 0)
        axon = image["in_axon_start"][group] + image["route_axon"][part][used]
        sources.append(firsts[route] + used)
        contacts.append(start[axon] + image["route_atom"][part][used])
    source, contact = np.concatenate(sources), np.concatenate(contacts)
    order = np.argsort(source, kind="stable")
    return Pairs(source[order], contact[order])


def _check_routes(image: ChipImage) -> None:
    for route, group in enumerate(image["route_synapse"]):
        part, axons = image.part("route_start", route), image.part("in_axon_start", group)
        used = image["route_axon"][part] >= 0
        axon, atom = image["route_axon"][part][used], image["route_atom"][part][used]
        n_axons, label = axons.stop - axons.start, image.manifest["synapses"][group]["label"]
        if np.any(axon >= n_axons):
            reason = f"leads to axon {axon.max()} of {n_axons}"
            raise ImageError(_wrong_route(label, reason))
        rows = image["row_start"][group] + image["in_axon_row"][axons][axon]
        wrong = (atom < 0) | (atom >= image["row_atoms"][rows])
        if wrong.any():
            first = wrong.argmax()
            reason = f"chooses atom {atom[first]} of {image['row_atoms'][rows[first]]}"
            raise ImageError(_wrong_route(label, reason))


def _wrong_route(label: str, reason: str) -> str:
    return f"synapse group '{label}': a route {reason}; compile the image again"


def _check_targets(
    image: ChipImage, rows: Rows, row: np.ndarray, base: np.ndarray, block: np.ndarray
) -> None:
    filled = np.diff(rows.start) > 0
    lowest, highest = (np.zeros(len(filled), dtype=int) for _ in range(2))
    # Targets of a row ascend.
    lowest[filled] = rows.indices[rows.start[:-1][filled]]
    highest[filled] = rows.indices[rows.start[1:][filled] - 1]
    sizes = np.diff(image["block_start"])
    wrong = (base >= 0) & ((lowest[row] < 0) | (base + highest[row] >= sizes[block]))
    wrong &= filled[row]
    if wrong.any():
        label = image.manifest["blocks"][block[wrong.argmax()]]["label"]
        raise ImageError(
            f"block '{label}': a synapse targets a compartment outside the block of "
            f"{sizes[block[wrong.argmax()]]}; compile the image again"
        )
