"""The search for cuts of blocks that are too large for a core."""

from collections.abc import Mapping

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries
from spikeport.compile.image.tables import part
from spikeport.compile.image.usage import axon_slots, out_slots
from spikeport.compile.placing.cut import can_cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import Capacity, Load, ProfileMasks, block_loads
from spikeport.hardware_models.chip import ChipModel


class Search:
    """A search for cuts of an image's blocks."""

    def __init__(self, image: ChipImage, chip: ChipModel) -> None:
        self._image, self._chip = image, chip
        self._loads = block_loads(image, chip)
        self._masks, self._cuttable = ProfileMasks(image), can_cut(image)
        self._demands: dict[int, Demand] = {}
        self._found: dict[tuple[int, Capacity, bytes], list[int]] = {}
        self._uncut_slots = out_slots(image, chip)
        paths = deliveries(image)
        # Cuts change only the output axons of sources, and spikes from the host need none of a
        # core.
        self._paths = paths.of(paths.source < image.n_compartments)

    def cuts(self, room: Capacity) -> dict[int, list[int]]:
        """Return the cuts of blocks that are too large, as `cut` takes them.

        Each piece is as long as there is room for. A target in pieces takes more output axons of
        its sources, so the search repeats until nothing changes.
        """
        slots = self._uncut_slots
        bounds: dict[int, list[int]] = {}
        # Ends since slots only grow, and are bounded by one piece for each compartment.
        while (found := self._bounds(room, slots)) != bounds:
            bounds = found
            slots = np.maximum(slots, self._slots(bounds))
        return {block: ends[1:-1] for block, ends in bounds.items()}

    def _bounds(self, room: Capacity, slots: np.ndarray) -> dict[int, list[int]]:
        """Return the ends of pieces, 0 to the last, if axons take (n_compartments,) slots."""
        large = [
            block
            for block in np.flatnonzero(self._cuttable).tolist()
            if not room.holds(self._load(block, slots))
        ]
        found = {block: self._stretches(block, room, slots) for block in large}
        return {block: ends for block, ends in found.items() if ends}

    def _stretches(self, block: int, room: Capacity, slots: np.ndarray) -> list[int]:
        """Return the ends of pieces that each fit; none if one compartment alone does not."""
        # Cuts elsewhere change little: most blocks are searched again with the same slots.
        own = slots[part(self._image.blocks.start, block)]
        key = block, room, own.tobytes()
        if key not in self._found:
            self._found[key] = _cut_greedily(self._demand(block), room, slots)
        return self._found[key]

    def _load(self, block: int, slots: np.ndarray) -> Load:
        # A cut of its targets changes nothing of a block but its output axons.
        compartments, in_axons, out, bits = self._loads[block].amounts
        # A whole block may share axons of populations; pieces count as if they did not.
        more = (slots - self._uncut_slots)[part(self._image.blocks.start, block)]
        amounts = (compartments, in_axons, out + int(more.sum()), bits)
        return self._loads[block]._replace(amounts=amounts)

    def _demand(self, block: int) -> Demand:
        if block not in self._demands:
            self._demands[block] = Demand(self._image, self._chip, block, self._masks)
        return self._demands[block]

    def _slots(self, bounds: Mapping[int, list[int]]) -> np.ndarray:
        """Return the slots that output axons take with these cuts, (n_compartments,)."""
        pieces: dict[int, np.ndarray] = {}
        for block, ends in bounds.items():
            pieces |= self._demand(block).pieces_reached(ends)
        # An axon of a group that is cut becomes one axon of each piece in which it has targets.
        more = np.zeros(len(self._image.in_axons), dtype=int)
        per_axon = axon_slots(self._image, self._chip)
        for group, reached in pieces.items():
            axons = part(self._image.groups.axon_start, group)
            more[axons] = (reached - 1) * per_axon[group]
        slots = self._uncut_slots.copy()
        np.add.at(slots, self._paths.source, more[self._paths.axon])
        return slots


def _cut_greedily(demand: Demand, room: Capacity, slots: np.ndarray) -> list[int]:
    ends, length = [0], demand.n
    while ends[-1] < demand.n:
        # Most pieces of a block are as long as the one before.
        end = demand.longest(ends[-1], slots, room, likely=length)
        length = end - ends[-1]
        if not length:
            return []
        ends.append(end)
    return ends
