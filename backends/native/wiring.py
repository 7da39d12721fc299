"""Chip image -> the flat arrays that spikes are delivered along.

A spike of a source reaches *contacts* (`spikeport.backends.native.contacts`), each of which adds a
row of weights to the inputs of some compartments. Contacts that the same sources reach are one
*delivery*: their spikes are counted first, and the rows are added once, times the count. Rows are
stored in the order of deliveries, and added as *runs*: stretches of consecutive targets with
consecutive weights. The rows that one neuron has on the many cores of the next layer are one run.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from spikeport.backends.native.contacts import Contacts, Pairs, contacts_of, pairs_of
from spikeport.backends.native.rows import Rows, offsets_of, rows_of, runs_of
from spikeport.compile.image import ChipImage


class Wiring(NamedTuple):
    """Where spikes go. Arrays called ``x_start`` divide others, as in a chip image."""

    delivery_start: np.ndarray
    """(n_sources + 1,) deliveries of each source."""
    delivery: np.ndarray
    """Their numbers."""
    run_start: np.ndarray
    """(n_deliveries + 1,) runs of each delivery."""
    run: np.ndarray
    """(n_runs, 4) of each run: its first target, where its weights begin, how many they are, and by
    how many bits more than ``shift`` they are to be shifted."""
    weights: np.ndarray
    """All weights, shifted right; int32 where something learns, else as narrow as they fit."""
    shift: int
    """Bits by which the weights of all runs are to be shifted."""
    fan: np.ndarray
    """(n_sources,) the fan of each source: those of a core whose spikes cost the same share it."""
    fan_start: np.ndarray
    """(n_fans + 1,) destination cores of each fan."""
    cost: np.ndarray
    """(.., 3) the core, the synapses a spike reads there, and the core it is from, or -1."""


def wire(image: ChipImage) -> Wiring:
    """Flatten the routes, axons and rows of an image.

    Where something learns, every contact is a delivery of its own and weights stay in order.

    Raises
    ------
    ImageError
        If a synapse targets a compartment outside its block, or a route an axon outside its group.
    """
    learning = bool(image["synapse_learning"][:, 0].any())
    pairs, rows = pairs_of(image), rows_of(image)
    contacts = contacts_of(image, rows)
    used = contacts.used[pairs.contact]
    live = Pairs(pairs.source[used], pairs.contact[used])
    delivery = np.arange(len(contacts.row)) if learning else _deliveries(live, contacts)
    order = _reading_order(delivery, rows, contacts)
    place = rows.start[:-1] if learning else _places(rows, contacts.row[order])
    run_start, run = _runs(order, delivery, place, rows, contacts)
    leads = _first_of_each(delivery)[live.contact]
    return Wiring(
        delivery_start=_starts(live.source[leads], image),
        delivery=delivery[live.contact[leads]].astype(np.int32),
        run_start=run_start,
        run=run.astype(np.int32),
        weights=_placed(rows, place, (np.int32,) if learning else (np.int8, np.int16, np.int32)),
        shift=rows.common_shift,
        **_fans(image, pairs, rows, contacts),
    )


def _deliveries(live: Pairs, contacts: Contacts) -> np.ndarray:
    """(n_contacts,) the delivery of each contact, -1 where no spike arrives."""
    order = np.lexsort((live.source, live.contact))
    reached, first = np.unique(live.contact[order], return_index=True)
    delivery = np.full(len(contacts.row), -1)
    delivery[reached] = number_alike(live.source[order], np.append(first, len(order)))
    return delivery


def number_alike(values: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Number the parts that ``start`` divides ``values`` into; parts that are equal, alike."""
    content = values.tobytes()
    width = values.nbytes // max(len(values), 1)
    known: dict[bytes, int] = {}
    bounds = itertools.pairwise((start * width).tolist())
    return np.array([known.setdefault(content[a:b], len(known)) for a, b in bounds], dtype=int)


def _first_of_each(delivery: np.ndarray) -> np.ndarray:
    """(n_contacts,) whether each is the first of its delivery."""
    first = np.zeros(len(delivery), dtype=bool)
    first[np.unique(delivery, return_index=True)[1]] = True
    return first


def _reading_order(delivery: np.ndarray, rows: Rows, contacts: Contacts) -> np.ndarray:
    """Contacts that spikes reach, delivery by delivery, by ascending target."""
    filled = (np.diff(rows.start) > 0)[contacts.row]
    read = np.flatnonzero((delivery >= 0) & contacts.used & filled)
    lowest = contacts.first[read] + rows.indices[rows.start[contacts.row[read]]]
    return read[np.lexsort((lowest, delivery[read]))]


def _places(rows: Rows, read: np.ndarray) -> np.ndarray:
    """(n_rows,) where the weights of each row begin, once stored in the order they are read."""
    sizes = np.diff(rows.start)
    turn = np.full(len(sizes), len(read))
    turn[read[::-1]] = np.arange(len(read))[::-1]  # where a row is read often, its first turn
    order = np.argsort(turn, kind="stable")
    place = np.zeros(len(sizes), dtype=np.int64)
    place[order] = offsets_of(sizes[order])[:-1]
    return place


def _runs(
    order: np.ndarray, delivery: np.ndarray, place: np.ndarray, rows: Rows, contacts: Contacts
) -> tuple[np.ndarray, np.ndarray]:
    """The runs of each delivery."""
    start, run = runs_of(rows)
    row = contacts.row[order]
    of_contact, number = _expand(start[row], start[row + 1])
    row, of = row[of_contact], delivery[order][of_contact]
    index, synapse, length = run[number].T
    shift = rows.shift[row] - rows.common_shift
    target = contacts.first[order][of_contact] + index
    weight = place[row] + synapse - rows.start[row]
    begins = np.ones(len(row), dtype=bool)
    begins[1:] = (np.diff(of) != 0) | (target[1:] != (target + length)[:-1])
    begins[1:] |= (weight[1:] != (weight + length)[:-1]) | (np.diff(shift) != 0)
    first = np.flatnonzero(begins)
    length = np.add.reduceat(length, first) if len(first) else length
    run_start = np.searchsorted(of[first], np.arange(delivery.max(initial=-1) + 2))
    return run_start, np.stack([target[first], weight[first], length, shift[first]], axis=1)


def _expand(begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All numbers of all ranges, one range after the other, and which range each is of."""
    sizes = end - begin
    of = np.repeat(np.arange(len(sizes)), sizes)
    return of, np.arange(len(of)) + np.repeat(begin - offsets_of(sizes)[:-1], sizes)


def _placed(rows: Rows, place: np.ndarray, widths: Sequence[type]) -> np.ndarray:
    """The weights, each row in its place, in the first of the integer types that they fit."""
    order = np.argsort(place, kind="stable")
    _, synapse = _expand(rows.start[:-1][order], rows.start[1:][order])
    weights = rows.weights[synapse] >> np.repeat(rows.shift[order], np.diff(rows.start)[order])
    ends = weights.min(initial=0), weights.max(initial=0)
    fits = (t for t in widths if np.iinfo(t).min <= ends[0] and ends[1] <= np.iinfo(t).max)
    return weights.astype(next(fits))


def _fans(image: ChipImage, pairs: Pairs, rows: Rows, contacts: Contacts) -> dict[str, np.ndarray]:
    """What a spike costs where it arrives: messages and synaptic operations."""
    operations = np.where(contacts.used, rows.operations[contacts.row], 0)[pairs.contact]
    keys, of = np.unique(
        pairs.source * image.n_cores + contacts.core[pairs.contact], return_inverse=True
    )
    operations = np.bincount(of, weights=operations, minlength=len(keys)).astype(np.int64)
    source, core = np.divmod(keys, image.n_cores)
    n_inputs = int(image["input_size"].sum())
    home = np.append(image.compartment_core, np.full(n_inputs, -1))[source]
    cost = np.stack([core, operations, home], axis=1)
    start = _starts(source, image)
    fan = number_alike(cost, start)
    lead = np.unique(fan, return_index=True)[1]
    _, kept = _expand(start[lead], start[lead + 1])
    return {
        "fan": fan.astype(np.int32),
        "fan_start": offsets_of(np.diff(start)[lead]),
        "cost": cost[kept],
    }


def _starts(source: np.ndarray, image: ChipImage) -> np.ndarray:
    """Offsets of each source's entries in a list ordered by source."""
    n_sources = image.n_compartments + int(image["input_size"].sum())
    return offsets_of(np.bincount(source, minlength=n_sources))
