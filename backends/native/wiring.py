"""Chip image -> the flat arrays that spikes are delivered along.

A spike of a source reaches *deliveries*, one for each (input axon, atom) that its routes lead to. A
delivery adds one *row* of weights to the inputs of some compartments; a row is stored as *runs*,
stretches of consecutive targets, so that slices are added. Sources that reach the same axon share
its delivery: their spikes are counted first, and the row is added once, times the count.
"""

from typing import NamedTuple

import numpy as np

from spikeport.compile.fanout import first_sources
from spikeport.compile.image import ChipImage
from spikeport.errors import ImageError


class Wiring(NamedTuple):
    """Where spikes go. Arrays called ``x_start`` divide others, as in a chip image."""

    delivery_start: np.ndarray
    """(n_sources + 1,) deliveries of each source."""
    delivery: np.ndarray
    """Their numbers."""
    place: np.ndarray
    """(n_deliveries, 5) of each delivery: the compartment its targets count from, its first run and
    the one after its last, the core it arrives at, the synapses the chip reads for it."""
    run: np.ndarray
    """(n_runs, 3) of each run: its first target, where its weights begin, how many they are."""
    reached_start: np.ndarray
    """(n_sources + 1,) cores each source sends messages to."""
    reached_core: np.ndarray
    """Their numbers, each once a source."""
    weights: np.ndarray
    """All weights, int16 where they fit and nothing learns, else int32."""


def wire(image: ChipImage) -> Wiring:
    """Flatten the routes, axons and rows of an image.

    Raises
    ------
    ImageError
        If a synapse targets a compartment outside its block, or a route an axon outside its group.
    """
    atoms = image["row_atoms"]
    _check_routes(image)
    weight_start, kept = kept_synapses(image)
    indices, weights = image["indices"][kept], image["weights"][kept]
    axon_group = np.repeat(np.arange(len(image["synapse_block"])), np.diff(image["in_axon_start"]))
    axon_row = image["row_start"][axon_group] + image["in_axon_row"]
    per_axon = atoms[axon_row]
    axon_delivery = first_deliveries(image)
    delivery_axon = np.repeat(np.arange(len(axon_row)), per_axon)
    atom = np.arange(len(delivery_axon)) - axon_delivery[delivery_axon]
    row = _offsets(atoms)[axon_row[delivery_axon]] + atom
    block = image["synapse_block"][axon_group[delivery_axon]]
    base = image["in_axon_base"][delivery_axon]
    _check_targets(image, weight_start, indices, row, base, block)
    source, number = _pairs(image, axon_delivery)
    live = base[number] >= 0
    reached = np.unique(source * image.n_cores + image["block_core"][block][number])
    run_start, run = _runs(weight_start, indices)
    place = (
        image["block_start"][block] + base,
        run_start[row],
        run_start[row + 1],
        image["block_core"][block],
        _row_lengths(image)[row],
    )
    return Wiring(
        delivery_start=_starts(source[live], image),
        delivery=number[live].astype(np.int32),
        place=np.stack(place, axis=1).astype(np.int32),
        run=run.astype(np.int32),
        reached_start=_starts(reached // image.n_cores, image),
        reached_core=(reached % image.n_cores).astype(np.int32),
        weights=_narrow(weights, learning=bool(image["synapse_learning"][:, 0].any())),
    )


def first_deliveries(image: ChipImage) -> np.ndarray:
    """(n_axons + 1,) the first delivery of each input axon: it has one for each atom of its row."""
    group = np.repeat(np.arange(len(image["synapse_block"])), np.diff(image["in_axon_start"]))
    return _offsets(image["row_atoms"][image["row_start"][group] + image["in_axon_row"]])


def kept_synapses(image: ChipImage) -> tuple[np.ndarray, np.ndarray | slice]:
    """Where rows begin, split by atom, without synapses that a later one of their target hides.

    nengo-loihi adds a row with NumPy's ``q[indices] += weights``, of which the last entry of
    duplicate indices counts.

    Returns
    -------
    start : (n_rows + 1,) int array
        Synapses of each row.
    kept : (n_synapses,) int array, or slice
        Where they are in the image, those of a row by ascending target.
    """
    atoms = np.maximum(image["row_atoms"], 1)
    sizes = np.diff(image["row_weight_start"]) // atoms
    start = _offsets(np.repeat(sizes, image["row_atoms"]))
    row = np.repeat(np.arange(len(start) - 1), np.diff(start))
    indices = image["indices"]
    ascending = (np.diff(indices) > 0) | (np.diff(row) > 0)
    if ascending.all():
        return start, slice(None)
    order = np.lexsort((np.arange(len(row)), indices, row))
    last = np.append((np.diff(indices[order]) != 0) | (np.diff(row[order]) != 0), True)
    kept = order[last]
    return _offsets(np.bincount(row[kept], minlength=len(start) - 1)), kept


def _row_lengths(image: ChipImage) -> np.ndarray:
    sizes = np.diff(image["row_weight_start"]) // np.maximum(image["row_atoms"], 1)
    return np.repeat(sizes, image["row_atoms"])


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
    image: ChipImage,
    weight_start: np.ndarray,
    indices: np.ndarray,
    row: np.ndarray,
    base: np.ndarray,
    block: np.ndarray,
) -> None:
    filled = np.diff(weight_start) > 0
    lowest, highest = (np.zeros(len(filled), dtype=int) for _ in range(2))
    if len(indices):
        begin = weight_start[:-1][filled]
        lowest[filled] = np.minimum.reduceat(indices, begin)
        highest[filled] = np.maximum.reduceat(indices, begin)
    sizes = np.diff(image["block_start"])
    wrong = (base >= 0) & ((lowest[row] < 0) | (base + highest[row] >= sizes[block]))
    wrong &= filled[row]
    if wrong.any():
        label = image.manifest["blocks"][block[wrong.argmax()]]["label"]
        raise ImageError(
            f"block '{label}': a synapse targets a compartment outside the block of "
            f"{sizes[block[wrong.argmax()]]}; compile the image again"
        )


def _pairs(image: ChipImage, axon_delivery: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every source with every delivery its routes lead to, in the order of sources."""
    firsts = first_sources(image)
    sources, numbers = [np.zeros(0, int)], [np.zeros(0, int)]
    for route, group in enumerate(image["route_synapse"]):
        part = image.part("route_start", route)
        used = np.flatnonzero(image["route_axon"][part] >= 0)
        axon = image["in_axon_start"][group] + image["route_axon"][part][used]
        sources.append(firsts[route] + used)
        numbers.append(axon_delivery[axon] + image["route_atom"][part][used])
    source, number = np.concatenate(sources), np.concatenate(numbers)
    order = np.argsort(source, kind="stable")
    return source[order], number[order]


def _starts(source: np.ndarray, image: ChipImage) -> np.ndarray:
    """Offsets of each source's entries in a list ordered by source."""
    n_sources = image.n_compartments + int(image["input_size"].sum())
    return _offsets(np.bincount(source, minlength=n_sources))


def _runs(weight_start: np.ndarray, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stretches of consecutive targets: the first of each row, and all of them."""
    begins = np.ones(len(indices), dtype=bool)
    begins[1:] = np.diff(indices) != 1
    begins[weight_start[:-1][np.diff(weight_start) > 0]] = True
    first = np.flatnonzero(begins)
    length = np.diff(np.append(first, len(indices)))
    return np.searchsorted(first, weight_start), np.stack([indices[first], first, length], axis=1)


def _narrow(weights: np.ndarray, learning: bool) -> np.ndarray:
    limit = np.iinfo(np.int16).max
    fits = not learning and (len(weights) == 0 or np.abs(weights).max() <= limit)
    return weights.astype(np.int16 if fits else np.int32)


def _offsets(sizes: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
