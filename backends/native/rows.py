"""The weight rows of an image, one for each atom, as spikes add them."""

import itertools
from typing import NamedTuple

import numpy as np

from spikeport.compile.image import ChipImage

MOST_SHIFT = 31
"""Of 32 bits: nothing but the sign is left, and of zeros nothing is lost."""


class Rows(NamedTuple):
    """Rows of synapses, those of a row by ascending target, without those that are hidden."""

    start: np.ndarray
    """(n_rows + 1,) synapses of each row."""
    indices: np.ndarray
    """Target of each synapse, from the axon's base."""
    weights: np.ndarray
    """Weight of each synapse."""
    operations: np.ndarray
    """(n_rows,) synapses the chip reads, hidden ones included."""
    shift: np.ndarray
    """(n_rows,) bits by which all weights of its synapse group can be shifted without loss."""

    @property
    def common_shift(self) -> int:
        """Bits by which all weights can be shifted without loss."""
        return int(self.shift.min(initial=MOST_SHIFT))


def rows_of(image: ChipImage) -> Rows:
    """All rows of an image, split by atom."""
    atoms = image["row_atoms"]
    sizes = np.diff(image["row_weight_start"]) // np.maximum(atoms, 1)
    start, kept = kept_synapses(image)
    shift = np.repeat(_shifts(image), np.diff(image["row_start"]))
    return Rows(
        start,
        image["indices"][kept],
        image["weights"][kept],
        operations=np.repeat(sizes, atoms),
        shift=np.repeat(shift, atoms),
    )


def _shifts(image: ChipImage) -> np.ndarray:
    """(n_groups,) trailing zero bits that all weights of a group have; 0 where something learns."""
    if image["synapse_learning"][:, 0].any():
        return np.zeros(len(image["synapse_block"]), dtype=np.uint8)
    bounds = itertools.pairwise(image["row_weight_start"][image["row_start"]])
    bits = [int(np.bitwise_or.reduce(image["weights"][a:b])) for a, b in bounds]
    shifts = [(b & -b).bit_length() - 1 if b else MOST_SHIFT for b in bits]
    return np.array(shifts, dtype=np.uint8)


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
    start = offsets_of(np.repeat(sizes, image["row_atoms"]))
    indices = image["indices"]
    ascending = np.diff(indices) > 0
    ascending[start[1:-1][(start[1:-1] > 0) & (start[1:-1] < len(indices))] - 1] = True
    if ascending.all():
        return start, slice(None)
    row = np.repeat(np.arange(len(start) - 1), np.diff(start))
    order = np.lexsort((np.arange(len(row)), indices, row))
    last = np.append((np.diff(indices[order]) != 0) | (np.diff(row[order]) != 0), True)
    kept = order[last]
    return offsets_of(np.bincount(row[kept], minlength=len(start) - 1)), kept


def runs_of(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Stretches of consecutive targets.

    Returns
    -------
    start : (n_rows + 1,) int array
        Runs of each row.
    run : (n_runs, 3) int array
        First target from the axon's base, number of the first synapse, and how many they are.
    """
    begins = np.ones(len(rows.indices), dtype=bool)
    begins[1:] = np.diff(rows.indices) != 1
    begins[rows.start[:-1][np.diff(rows.start) > 0]] = True
    first = np.flatnonzero(begins)
    length = np.diff(np.append(first, len(rows.indices)))
    run = np.stack([rows.indices[first], first, length], axis=1)
    return np.searchsorted(first, rows.start), run


def offsets_of(sizes: np.ndarray) -> np.ndarray:
    """Where parts of these sizes begin, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
