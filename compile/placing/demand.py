"""What stretches of a block would take of a core, were the block cut there."""

from bisect import bisect_left
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from spikeport.compile.extract import flat
from spikeport.compile.image import ChipImage
from spikeport.compile.placing.load import Capacity, Load, ProfileMasks
from spikeport.compile.usage import ListFormat, layout, list_bits
from spikeport.hardware_models.chip import Chip


class _Synapses(NamedTuple):
    """A group's synapses by list, which is a row and the base it is read from.

    ``key`` holds list * n + target, ascending, for n compartments; ``of_axon`` the list each axon
    reads; ``readers`` how many axons read each list.
    """

    number: int
    key: np.ndarray
    of_axon: np.ndarray
    readers: np.ndarray
    form: ListFormat


class Demand:
    """What stretches of one block that can be cut would take.

    Parameters
    ----------
    image : ChipImage
        The image.
    chip : Chip
        Whose memory it is laid out for.
    block : int
        Number of the block.
    masks : ProfileMasks
        The image's profiles.
    """

    def __init__(self, image: ChipImage, chip: Chip, block: int, masks: ProfileMasks) -> None:
        start, end = image["block_start"][block : block + 2]
        self.start, self.n = int(start), int(end - start)
        self._block, self._masks, self._layout = block, masks, layout(chip)
        self._synapses = [
            _synapses(image, int(g), self.n, masks.forms[g]) for g in masks.groups[block]
        ]

    def load(self, first: int, end: int, slots: np.ndarray) -> Load:
        """What compartments ``first`` to ``end`` take.

        ``slots`` (n_compartments of the image,) are what their output axons take.
        """
        in_axons = bits = 0
        reached = []
        for synapses in self._synapses:
            sizes = self._sizes(synapses, first, end)
            if axons := int(synapses.readers[sizes > 0].sum()):
                in_axons += axons
                bits += list_bits(sizes, synapses.form, self._layout)
                reached.append(synapses.number)
        out = int(slots[self.start + first : self.start + end].sum())
        masks = self._masks.of(self._block, first, end, np.array(reached, dtype=int))
        return Load((end - first, in_axons, out, bits), masks)

    def longest(self, first: int, slots: np.ndarray, room: Capacity) -> int:
        """The end of the longest stretch from ``first`` on that there is room for."""
        ends = range(first + 1, self.n + 1)
        return first + bisect_left(
            ends, True, key=lambda end: not room.holds(self.load(first, end, slots))
        )

    def pieces_reached(self, bounds: list[int]) -> dict[int, np.ndarray]:
        """For each synapse group, how many pieces each of its axons has targets in."""
        return {
            synapses.number: np.sum(
                [self._sizes(synapses, first, end) > 0 for first, end in pairwise(bounds)], axis=0
            )[synapses.of_axon]
            for synapses in self._synapses
        }

    def _sizes(self, synapses: _Synapses, first: int, end: int) -> np.ndarray:
        """How many targets each list has in a stretch."""
        begin = np.arange(len(synapses.readers)) * self.n
        return np.searchsorted(synapses.key, begin + end) - np.searchsorted(
            synapses.key, begin + first
        )


def _synapses(image: ChipImage, group: int, n: int, form: ListFormat) -> _Synapses:
    axons = image.part("in_axon_start", group)
    reads = np.stack([image["in_axon_row"][axons], image["in_axon_base"][axons]], axis=1)
    lists, of_axon, readers = np.unique(reads, axis=0, return_inverse=True, return_counts=True)
    first_row = image["row_start"][group]
    keys = [
        i * n + base + image["indices"][image.part("row_weight_start", first_row + row)].astype(int)
        for i, (row, base) in enumerate(lists)
        if base >= 0
    ]
    return _Synapses(group, np.sort(flat(keys)), of_axon.reshape(-1), readers, form)
