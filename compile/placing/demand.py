"""The resources of a core that a stretch of a block would take if the block were cut there."""

from bisect import bisect_left
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.soft_rows import WORD_BITS, row_words
from spikeport.compile.image.tables import flat, part, ranges
from spikeport.compile.image.usage import layout, list_bits
from spikeport.compile.placing.load import Capacity, Load, ProfileMasks
from spikeport.hardware_models.chip import ChipModel


class _Synapses(NamedTuple):
    """The synapses of a group by list, which is a row with the base it is read from.

    ``key`` holds list * n + target, ascending, for n compartments; ``weight`` the weights in this
    order; ``begin`` the smallest possible key of each list; ``of_axon`` the list that each axon
    reads; ``readers`` the number of axons that read each list.
    """

    number: int
    key: np.ndarray
    weight: np.ndarray
    begin: np.ndarray
    of_axon: np.ndarray
    readers: np.ndarray

    def sizes(self, first: int, end: int) -> np.ndarray:
        """Return the number of targets of each list in a stretch."""
        # Keys ascend across all lists, so that two searches count the targets of every list.
        found: np.ndarray = self._place(end) - self._place(first)
        return found

    def soft_bits(self, first: int, sizes: np.ndarray) -> int:
        """Return the bits of the rows of a stretch, with lists of these sizes, in a soft core."""
        row, mine = np.repeat(np.arange(len(sizes)), sizes), ranges(self._place(first), sizes)
        words = row_words(row, self.key[mine], self.weight[mine], len(sizes))
        return WORD_BITS * int(words.sum())

    def _place(self, compartment: int) -> np.ndarray:
        """Return the place in ``key`` of the first target of each list from a compartment on."""
        return self.key.searchsorted(self.begin + compartment)


class Demand:
    """The demand of the stretches of one block that can be cut.

    Parameters
    ----------
    image : ChipImage
        The image.
    chip : ChipModel
        The chip whose memory layout counts.
    block : int
        Number of the block.
    masks : ProfileMasks
        The image's profiles.
    """

    def __init__(self, image: ChipImage, chip: ChipModel, block: int, masks: ProfileMasks) -> None:
        start, end = image.blocks.start[block : block + 2]
        self.start, self.n = int(start), int(end - start)
        self._block, self._masks, self._chip = block, masks, chip
        groups = [int(group) for group in masks.groups[block]]
        self._synapses = [_synapses(image, group, self.n) for group in groups]
        sizes = np.arange(1 + np.diff(image.rows.start).max(initial=0))
        # Tables by size: computing the bits for each stretch would take a third of the search.
        self._list_bits = {
            group: list_bits(sizes, masks.forms[group], layout(chip)) for group in groups
        }

    def load(self, first: int, end: int, slots: np.ndarray) -> Load:
        """Return the load of the compartments ``first`` to ``end``.

        ``slots`` (n_compartments of the image,) are the slots that their output axons take.
        """
        in_axons = bits = 0
        reached = []
        for synapses in self._synapses:
            sizes = synapses.sizes(first, end)
            if axons := int(synapses.readers[sizes > 0].sum()):
                in_axons += axons
                bits += self._bits(synapses, first, sizes)
                reached.append(synapses.number)
        out = int(slots[self.start + first : self.start + end].sum())
        masks = self._masks.of(self._block, first, end, np.array(reached, dtype=int))
        return Load((end - first, in_axons, out, bits), masks)

    def _bits(self, synapses: _Synapses, first: int, sizes: np.ndarray) -> int:
        """Return the bits of a group's lists of these sizes, in a stretch."""
        if self._chip.soft_memory is not None:
            return synapses.soft_bits(first, sizes)
        return int(self._list_bits[synapses.number][sizes].sum())

    def longest(self, first: int, slots: np.ndarray, room: Capacity, likely: int) -> int:
        """Return the end of the longest stretch from ``first`` on that there is room for.

        The search begins at a ``likely`` length. In a soft core a longer row may take less memory,
        if it is stored without gaps: there the stretch is long, but maybe not the longest.
        """

        def is_full(end: int) -> bool:
            return not room.holds(self.load(first, end, slots))

        # On other chips a stretch never takes less than its parts, so bisection finds the longest.
        ends = range(first + 1, self.n + 1)
        low, high = 0, len(ends)
        likely = min(likely, high)
        for place in (likely - 1, likely):
            if low <= place < high:
                low, high = (low, place) if is_full(ends[place]) else (place + 1, high)
        return first + bisect_left(ends, True, low, high, key=is_full)

    def pieces_reached(self, bounds: list[int]) -> dict[int, np.ndarray]:
        """Return the number of pieces that each axon has targets in, by synapse group."""
        return {
            synapses.number: np.sum(
                [synapses.sizes(first, end) > 0 for first, end in pairwise(bounds)], axis=0
            )[synapses.of_axon]
            for synapses in self._synapses
        }


def _synapses(image: ChipImage, group: int, n: int) -> _Synapses:
    axons = part(image.groups.axon_start, group)
    # `cut` lets axons that read a row from the same base share it, so its bits count only once.
    reads = np.stack([image.in_axons.row[axons], image.in_axons.base[axons]], axis=1)
    lists, of_axon, readers = np.unique(reads, axis=0, return_inverse=True, return_counts=True)
    first_row = image.groups.row_start[group]
    # A list without a base has no keys: it delivers nothing, and no piece needs its axons.
    synapses = [part(image.rows.start, first_row + row) for row, base in lists if base >= 0]
    bases = [i * n + base for i, (_, base) in enumerate(lists) if base >= 0]
    indices = [image.synapses.index[mine].astype(int) for mine in synapses]
    key = flat([base + index for base, index in zip(bases, indices, strict=True)])
    weight = flat([image.synapses.weight[mine] for mine in synapses])
    order, begin = np.argsort(key, kind="stable"), np.arange(len(lists)) * n
    return _Synapses(group, key[order], weight[order], begin, of_axon.reshape(-1), readers)
