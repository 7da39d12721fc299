"""Contacts of an image: an axon and an atom each, and the sources that reach them."""

from spikeport.backends.native.contacts import contacts_of, first_contacts, pairs_of
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route


def network() -> ChipImage:
    """Return rows of two atoms and of one, read by three axons, the last of which has no base."""
    group = Group([[[64], [128]], [192]], axon_row=[1, 0, 1], axon_base=[2, 1, -1], block=1)
    routes = [Route([1, 0], [1, 0], block=0), Route([1, 2], [0, 0], input=0)]
    return Parts([Block(2), Block(3, core=1)], [group], [2], routes).image()


def test_an_axon_has_a_contact_for_each_atom_of_its_row() -> None:
    assert first_contacts(network()).tolist() == [0, 1, 3, 4]


def test_a_contact_has_row_target_and_core() -> None:
    contacts = contacts_of(network())
    assert contacts.row.tolist() == [2, 0, 1, 2]  # rows are counted atom by atom
    assert contacts.first.tolist()[:3] == [4, 3, 3]
    assert contacts.core.tolist() == [1, 1, 1, 1]
    assert contacts.used.tolist() == [True, True, True, False]


def test_pairs_are_in_the_order_of_sources() -> None:
    # sources: compartments 0 and 1 of block 0, 2 to 4 of block 1, 5 and 6 on the host
    pairs = pairs_of(network())
    assert list(zip(pairs.source.tolist(), pairs.contact.tolist(), strict=True)) == [
        (0, 2),
        (1, 0),
        (5, 1),
        (6, 3),
    ]
