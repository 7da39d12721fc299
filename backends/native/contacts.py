"""Ends of the routes of an image: *contacts*, one for each atom of an input axon."""

from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries
from spikeport.compile.image.tables import offsets


class Contacts(NamedTuple):
    """The contacts of an image: arrays of (n_contacts,)."""

    row: np.ndarray
    """The row of weights that each contact adds."""
    first: np.ndarray
    """The compartment that the row's targets count from."""
    core: np.ndarray
    """The core of the contact."""
    used: np.ndarray
    """Mask of contacts whose axon has a base: an axon without a base delivers no spikes."""


class Pairs(NamedTuple):
    """A source and a contact for each way that a spike can take, in the order of sources."""

    source: np.ndarray
    contact: np.ndarray


def contacts_of(image: ChipImage) -> Contacts:
    """Return all contacts of an image."""
    # A contact is an axon and an atom, since the atom of a spike selects the part of the row that
    # it adds; plain axons have one atom.
    start = first_contacts(image)
    axon = np.repeat(np.arange(len(image.in_axons)), np.diff(start))
    atom = np.arange(len(axon)) - start[axon]
    block, base = image.groups.block[image.axon_group[axon]], image.in_axons.base[axon]
    return Contacts(
        row=offsets(image.rows.atoms)[image.axon_row[axon]] + atom,
        first=image.blocks.start[block] + base,
        core=image.blocks.core[block],
        used=base >= 0,
    )


def first_contacts(image: ChipImage) -> np.ndarray:
    """Return the first contact of each input axon, which has one for each atom of its row.

    The array has one entry more than there are axons, (n_axons + 1,).
    """
    return offsets(image.rows.atoms[image.axon_row])


def pairs_of(image: ChipImage) -> Pairs:
    """Return every source with every contact its routes lead to."""
    paths = deliveries(image)
    contact = first_contacts(image)[paths.axon] + paths.atom
    # In the order of sources: kernels read the contacts of one source after the other.
    order = np.argsort(paths.source, kind="stable")
    return Pairs(paths.source[order], contact[order])
