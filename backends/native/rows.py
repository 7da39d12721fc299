"""The weight rows of an image, one for each atom, as spikes add them."""

from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import row_lengths
from spikeport.compile.image.tables import offsets, parts

MOST_SHIFT = 31
"""Largest shift of 32 bits, for groups whose weights are all zero: they lose nothing."""


class KernelRows(NamedTuple):
    """Rows of synapses by ascending target, without hidden synapses; see `kept_synapses`."""

    start: np.ndarray
    """Start of each row among the synapses, (n_rows + 1,)."""
    indices: np.ndarray
    """Target of each synapse, from the axon's base."""
    weights: np.ndarray
    """Weight of each synapse."""
    operations: np.ndarray
    """Number of synapses that the chip reads in each row, including hidden ones, (n_rows,)."""
    shift: np.ndarray
    """Bits by which all weights of a row's synapse group can be shifted without loss, (n_rows,)."""

    @property
    def common_shift(self) -> int:
        """Bits by which all weights can be shifted without loss."""
        return int(self.shift.min(initial=MOST_SHIFT))


def rows_of(image: ChipImage) -> KernelRows:
    """Return all rows of an image, split by atom."""
    atoms = image.rows.atoms
    sizes = row_lengths(image)
    start, kept = kept_synapses(image)
    shift = _shifts(image)[image.row_group]
    return KernelRows(
        start,
        image.synapses.index[kept],
        image.synapses.weight[kept],
        operations=np.repeat(sizes, atoms),
        shift=np.repeat(shift, atoms),
    )


def _shifts(image: ChipImage) -> np.ndarray:
    """Return the trailing zero bits of all weights of each group, (n_groups,)."""
    # Learning can set any bit of a weight later on.
    if image.learns.any():
        return np.zeros(len(image.groups.block), dtype=np.uint8)
    # A bit is zero in every weight of a group if it is zero in the bitwise or of the weights.
    weights = parts(image.synapse_start, image.synapses.weight)
    bits = [int(np.bitwise_or.reduce(of_group)) for of_group in weights]
    # b & -b keeps the lowest bit that is set.
    shifts = [(b & -b).bit_length() - 1 if b else MOST_SHIFT for b in bits]
    return np.array(shifts, dtype=np.uint8)


def kept_synapses(image: ChipImage) -> tuple[np.ndarray, np.ndarray | slice]:
    """Return the starts of rows, split by atom, without synapses that a later one hides.

    nengo-loihi adds a row with NumPy's ``q[indices] += weights``, where only the last entry of
    duplicate indices counts.

    Returns
    -------
    start : (n_rows + 1,) int array
        Start of each row among the kept synapses.
    kept : (n_synapses,) int array, or slice
        Places of the kept synapses in the image, by ascending target within a row.
    """
    atoms = image.rows.atoms
    sizes = row_lengths(image)
    start = offsets(np.repeat(sizes, atoms))
    indices = image.synapses.index
    ascending = np.diff(indices) > 0
    # Targets must ascend within a row only: the next row may begin with a lower one.
    ascending[start[1:-1][(start[1:-1] > 0) & (start[1:-1] < len(indices))] - 1] = True
    if ascending.all():
        return start, slice(None)
    row = np.repeat(np.arange(len(start) - 1), np.diff(start))
    # Sort by row, then target, then place, and keep the last of equal targets.
    order = np.lexsort((np.arange(len(row)), indices, row))
    last = np.append((np.diff(indices[order]) != 0) | (np.diff(row[order]) != 0), True)
    kept = order[last]
    return offsets(np.bincount(row[kept], minlength=len(start) - 1)), kept


class Runs(NamedTuple):
    """Stretches of consecutive targets in rows."""

    start: np.ndarray
    """Start of each row among the runs, (n_rows + 1,)."""
    run: np.ndarray
    """First target from the axon's base, number of the first synapse, and size, (n_runs, 3)."""


def runs_of(rows: KernelRows) -> Runs:
    """Return the stretches of consecutive targets."""
    begins = np.ones(len(rows.indices), dtype=bool)
    begins[1:] = np.diff(rows.indices) != 1
    # A row begins a run, even where its first target follows the last one of the row before.
    begins[rows.start[:-1][np.diff(rows.start) > 0]] = True
    first = np.flatnonzero(begins)
    length = np.diff(np.append(first, len(rows.indices)))
    run = np.stack([rows.indices[first], first, length], axis=1)
    return Runs(np.searchsorted(first, rows.start), run)
