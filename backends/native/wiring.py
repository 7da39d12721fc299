"""The wiring of a chip image: flat arrays that spikes are delivered by.

A spike of a source reaches *contacts* (`spikeport.backends.native.contacts`), each of which adds a
row of weights to the inputs of some compartments. Contacts that the same sources reach are one
*delivery*: their spikes are counted first, and the rows are added once, times the count. Rows are
stored in the order of deliveries, and added as *runs*: stretches of consecutive targets with
consecutive weights. The rows that one neuron has on the many cores of the next layer are one run.
A run of a few targets costs more to begin than to add: such weights are *scattered*, lists of
targets and values instead of runs.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from spikeport.arrays import number_alike
from spikeport.backends.native.contacts import Contacts, Pairs, contacts_of, pairs_of
from spikeport.backends.native.rows import KernelRows, Runs, rows_of, runs_of
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import offsets, ranges
from spikeport.errors import ImageError

MOST_PARTS = 1 << 22
MOST_SHARED = 32
"""Limits of the runs of weights: the number always allowed, and the number per held entry."""

NARROW_SHIFT = 6
"""Shift from which sums need no more than 16 of the 22 bits of q."""
SHORT = 8
"""Length below which a run is scattered."""
LANES = 32
"""Number of weights that are added at once."""
MOST_GROWTH = 3
"""Factor by which runs and their weights may grow as they are lined up."""
CACHE_LINE = 64
"""Bytes of a cache line."""


class Wiring(NamedTuple):
    """The tables that deliver spikes. Arrays ``x_start`` divide others, as in a chip image."""

    delivery_start: np.ndarray
    """Start of each source among the deliveries, (n_sources + 1,)."""
    delivery: np.ndarray
    """Numbers of the deliveries."""
    run_start: np.ndarray
    """Start of each delivery among the runs, (n_deliveries + 1,)."""
    run: np.ndarray
    """First target of each run, beginning and number of its weights, and the bits by which they are
    to be shifted beyond ``shift``, (n_runs, 4)."""
    weights: np.ndarray
    """The weights, shifted right; int32 if anything learns, else the narrowest type that fits."""
    scattered_start: np.ndarray
    """Start of each delivery among the scattered weights, (n_deliveries + 1,)."""
    target: np.ndarray
    """Target of each scattered weight."""
    value: np.ndarray
    """The scattered weights in units of 2^shift, in the type of the sums."""
    shift: int
    """Bits by which the weights of all runs must be shifted to the left."""
    fan: np.ndarray
    """Fan of each source; sources of a core with equal costs share a fan, (n_sources,)."""
    fan_start: np.ndarray
    """Start of each fan among the costs, (n_fans + 1,)."""
    cost: np.ndarray
    """Core, synapses that a spike reads there, core of the source (-1: the host), (.., 3)."""

    @property
    def sums_type(self) -> type:
        """The type of the sums: int16 where q has no more bits, else int32."""
        return np.int16 if self.shift >= NARROW_SHIFT else np.int32


def wire(image: ChipImage, cores: np.ndarray | None = None) -> Wiring:
    """Flatten the routes, axons and rows of an image, or only those into some of its cores.

    If anything learns, every contact is a delivery of its own and weights stay in order.

    Raises
    ------
    ImageError
        If a number of the image points outside its tables, or axons share rows so often that the
        arrays would be out of all proportion to the image.
    """
    learning = bool(image.learns.any())
    rows = rows_of(image.checked)
    runs = runs_of(rows)
    _check_proportion(image, np.diff(runs.start))
    pairs, contacts = pairs_of(image), contacts_of(image)
    if cores is not None:
        mine = np.isin(contacts.core, cores)[pairs.contact]
        pairs = Pairs(pairs.source[mine], pairs.contact[mine])
    # Spikes to an axon without a base are counted as messages, but deliver nothing.
    used = contacts.used[pairs.contact]
    live = Pairs(pairs.source[used], pairs.contact[used])
    delivery = np.arange(len(contacts.row)) if learning else _deliveries(live, contacts)
    order = _reading_order(delivery, rows, contacts)
    place = rows.start[:-1] if learning else _places(rows, contacts.row[order])
    run_start, run = _runs(order, delivery, place, rows, runs, contacts)
    weights = _placed(rows, place, (np.int32,) if learning else (np.int8, np.int16, np.int32))
    # The first contact of a delivery stands for all: they have the same sources.
    leads = _first_of_each(delivery)[live.contact]
    wiring = Wiring(
        delivery_start=_starts(live.source[leads], image),
        delivery=delivery[live.contact[leads]].astype(np.int32),
        run_start=run_start,
        run=run.astype(np.int32),
        weights=weights,
        scattered_start=np.zeros_like(run_start),
        target=np.zeros(0, dtype=np.int32),
        value=np.zeros(0, dtype=np.int32),
        shift=rows.common_shift,
        **_fans(image, pairs, rows, contacts),
    )
    # Nothing is scattered if the image learns: learning writes to the weights of runs.
    return _scatter(wiring, 0 if learning else SHORT)


def _check_proportion(image: ChipImage, n_runs: np.ndarray) -> None:
    """Refuse images whose axons share rows more often than any network's do.

    ``n_runs`` counts the runs of each row, atom by atom.
    """
    rows = image.rows
    row_of = np.repeat(np.arange(len(rows)), rows.atoms)
    in_row = np.bincount(row_of, weights=n_runs, minlength=len(rows)) + rows.atoms
    # Axons that share a row are cheap in a file, but each takes runs of its own here.
    found = int(in_row[image.axon_row].sum())
    held = len(image.synapses) + len(image.in_axons) + len(image.out_axons)
    most = max(MOST_PARTS, MOST_SHARED * held)
    if found > most:
        raise ImageError(
            f"its axons read {found:,} runs of weights, limit {most:,} for an image of {held:,} "
            "axons and weights: rows are shared out of all proportion; compile it again"
        )


def _deliveries(live: Pairs, contacts: Contacts) -> np.ndarray:
    """Return the delivery of each contact, -1 where no spike arrives, (n_contacts,)."""
    # Sorted by contact, then source: contacts of the same sources have equal stretches.
    order = np.lexsort((live.source, live.contact))
    reached, first = np.unique(live.contact[order], return_index=True)
    delivery = np.full(len(contacts.row), -1)
    delivery[reached] = number_alike(live.source[order], np.append(first, len(order)))
    return delivery


def _first_of_each(delivery: np.ndarray) -> np.ndarray:
    """Return the contacts that are the first of their delivery, (n_contacts,)."""
    first = np.zeros(len(delivery), dtype=bool)
    first[np.unique(delivery, return_index=True)[1]] = True
    return first


def _reading_order(delivery: np.ndarray, rows: KernelRows, contacts: Contacts) -> np.ndarray:
    """Return the contacts that spikes reach, delivery by delivery, by ascending target."""
    filled = (np.diff(rows.start) > 0)[contacts.row]
    read = np.flatnonzero((delivery >= 0) & contacts.used & filled)
    lowest = contacts.first[read] + rows.indices[rows.start[contacts.row[read]]]
    return read[np.lexsort((lowest, delivery[read]))]


def _places(rows: KernelRows, read: np.ndarray) -> np.ndarray:
    """Return the beginning of each row's weights, stored in the order they are read, (n_rows,)."""
    sizes = np.diff(rows.start)
    turn = np.full(len(sizes), len(read))
    turn[read[::-1]] = np.arange(len(read))[::-1]  # the first turn of a row that is read often
    order = np.argsort(turn, kind="stable")
    place = np.zeros(len(sizes), dtype=np.int64)
    place[order] = offsets(sizes[order])[:-1]
    return place


def _runs(
    order: np.ndarray,
    delivery: np.ndarray,
    place: np.ndarray,
    rows: KernelRows,
    runs: Runs,
    contacts: Contacts,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the start of each delivery's runs, and the runs."""
    row = contacts.row[order]
    of_contact, number = _expand(runs.start[row], runs.start[row + 1])
    row, of = row[of_contact], delivery[order][of_contact]
    index, synapse, length = runs.run[number].T
    shift = rows.shift[row] - rows.common_shift
    target = contacts.first[order][of_contact] + index
    weight = place[row] + synapse - rows.start[row]
    # Runs join where targets and weights both go on, and the shift is the same.
    begins = np.ones(len(row), dtype=bool)
    begins[1:] = (np.diff(of) != 0) | (target[1:] != (target + length)[:-1])
    begins[1:] |= (weight[1:] != (weight + length)[:-1]) | (np.diff(shift) != 0)
    first = np.flatnonzero(begins)
    length = np.add.reduceat(length, first) if len(first) else length
    run_start = np.searchsorted(of[first], np.arange(delivery.max(initial=-1) + 2))
    return run_start, np.stack([target[first], weight[first], length, shift[first]], axis=1)


def _scatter(wiring: Wiring, short: int) -> Wiring:
    """Turn all runs with fewer targets than ``short`` into scattered weights."""
    first, weight, length, shift = wiring.run.T
    is_short = length < short
    of_run, target = _expand(first[is_short], (first + length)[is_short])
    _, number = _expand(weight[is_short], (weight + length)[is_short])
    value = wiring.weights[number].astype(np.int32) << shift[is_short][of_run]
    shorts = offsets(is_short)
    return wiring._replace(
        run_start=wiring.run_start - shorts[wiring.run_start],
        run=wiring.run[~is_short],
        scattered_start=offsets(length * is_short)[wiring.run_start],
        target=target.astype(np.uint16 if target.max(initial=0) < 2**16 else np.int32),
        value=value.astype(wiring.sums_type),
    )


def line_up(wiring: Wiring) -> Wiring:
    """Surround the weights of runs with zeros, so that each run is whole vectors of `LANES`.

    A run then begins at a target that is a multiple of `LANES`: its weights, and the sums that they
    are added to, lie in as few cache lines as possible. Runs with the same weights still share
    them, in line with the run of the lowest target. If runs are so short that they would take more
    than `MOST_GROWTH` times the memory, nothing changes.
    """
    # Sort by place, length and target: the lowest target of runs with equal weights comes first.
    order = np.lexsort(wiring.run[:, [0, 2, 1]].T)
    run = wiring.run[order].astype(np.int64)
    leads = np.ones(len(run), dtype=bool)
    leads[1:] = (np.diff(run[:, 1:3], axis=0) != 0).any(axis=1)
    target, place, length, _ = run[leads].T
    before = target % LANES
    size = -(-(before + length) // LANES) * LANES
    held = wiring.weights.nbytes + wiring.run.nbytes
    if size.sum() * wiring.weights.itemsize + wiring.run.nbytes > MOST_GROWTH * held:
        return wiring
    begin, of = offsets(size), np.cumsum(leads) - 1
    weights = aligned_zeros(size.sum(), wiring.weights.dtype)
    _, source = _expand(place, place + length)
    _, there = _expand(begin[:-1] + before, begin[:-1] + before + length)
    weights[there] = wiring.weights[source]
    lined_up = np.empty_like(wiring.run)
    lined_up[order] = np.column_stack([run[:, 0] - before[of], begin[of], size[of], run[:, 3]])
    return wiring._replace(run=lined_up, weights=weights)


def aligned_zeros(n: int, dtype: np.dtype[Any] | type, room: int = 0) -> np.ndarray:
    """Return zeros, (n,), that begin with a cache line, with ``room`` more behind them."""
    size = np.dtype(dtype).itemsize
    # NumPy does not align to cache lines: one line more lets the zeros begin where a line begins.
    memory: np.ndarray = np.zeros(n + room + CACHE_LINE // size, dtype=dtype)
    skipped = -memory.ctypes.data % CACHE_LINE // size
    return memory[skipped : skipped + n]


def _expand(begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lay ranges of numbers end to end; return the range of each number, and the numbers."""
    sizes = end - begin
    return np.repeat(np.arange(len(sizes)), sizes), ranges(begin, sizes)


def _placed(rows: KernelRows, place: np.ndarray, widths: Sequence[type]) -> np.ndarray:
    """Return the weights, each row in its place, in the narrowest of the types that fits them."""
    order = np.argsort(place, kind="stable")
    _, synapse = _expand(rows.start[:-1][order], rows.start[1:][order])
    weights = rows.weights[synapse] >> np.repeat(rows.shift[order], np.diff(rows.start)[order])
    ends = weights.min(initial=0), weights.max(initial=0)
    fits = (t for t in widths if np.iinfo(t).min <= ends[0] and ends[1] <= np.iinfo(t).max)
    result: np.ndarray = weights.astype(next(fits))
    return result


def _fans(
    image: ChipImage, pairs: Pairs, rows: KernelRows, contacts: Contacts
) -> dict[str, np.ndarray]:
    """Return the fans: costs of spikes where they arrive, in messages and synaptic operations."""
    operations = np.where(contacts.used, rows.operations[contacts.row], 0)[pairs.contact]
    keys, of = np.unique(
        pairs.source * image.n_cores + contacts.core[pairs.contact], return_inverse=True
    )
    operations = np.bincount(of, weights=operations, minlength=len(keys)).astype(np.int64)
    source, core = np.divmod(keys, image.n_cores)
    # The host has no core: -1 counts its messages by themselves.
    home = np.append(image.compartment_core, np.full(image.n_inputs, -1))[source]
    cost = np.stack([core, operations, home], axis=1)
    start = _starts(source, image)
    # Sources of a core with equal costs share a fan: spikes are counted by fan, not by source.
    fan = number_alike(cost, start)
    lead = np.unique(fan, return_index=True)[1]
    _, kept = _expand(start[lead], start[lead + 1])
    return {
        "fan": fan.astype(np.int32),
        "fan_start": offsets(np.diff(start)[lead]),
        "cost": cost[kept].astype(np.int32),
    }


def _starts(source: np.ndarray, image: ChipImage) -> np.ndarray:
    """Return the offsets of each source's entries in a list ordered by source."""
    return offsets(np.bincount(source, minlength=image.n_sources))
