"""Where blocks that are too large for a core are to be cut."""

from collections.abc import Mapping

import numpy as np

from spikeport.compile.image import ChipImage
from spikeport.compile.placing.cut import can_cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import Capacity, Load, ProfileMasks, block_loads
from spikeport.compile.usage import axon_slots, out_slots
from spikeport.hardware_models.chip import Chip


class Search:
    """Searches for cuts of an image's blocks."""

    def __init__(self, image: ChipImage, chip: Chip) -> None:
        self._image, self._chip = image, chip
        self._loads = block_loads(image, chip)
        self._masks, self._cuttable = ProfileMasks(image), can_cut(image)
        self._demands: dict[int, Demand] = {}
        self._uncut_slots = out_slots(image, chip)

    def bounds(self, room: Capacity) -> dict[int, list[int]]:
        """Where to cut the blocks that are too large: the ends of their pieces, 0 to the last.

        Each piece is as long as there is room for. A target in pieces takes more of the output
        axons of its sources, so cuts are sought again until nothing changes; slots are never given
        back, which ends the search.
        """
        slots = self._uncut_slots
        bounds: dict[int, list[int]] = {}
        while (found := self._bounds(room, slots)) != bounds:
            bounds = found
            slots = np.maximum(slots, self._slots(bounds))
        return bounds

    def _bounds(self, room: Capacity, slots: np.ndarray) -> dict[int, list[int]]:
        """Where to cut if output axons take these slots, (n_compartments,)."""
        large = [
            block
            for block in np.flatnonzero(self._cuttable).tolist()
            if not room.holds(self._load(block, slots))
        ]
        found = {block: _stretches(self._demand(block), room, slots) for block in large}
        return {block: ends for block, ends in found.items() if ends}

    def _load(self, block: int, slots: np.ndarray) -> Load:
        compartments, in_axons, _, bits = self._loads[block].amounts
        out = int(slots[self._image.part("block_start", block)].sum())
        return self._loads[block]._replace(amounts=(compartments, in_axons, out, bits))

    def _demand(self, block: int) -> Demand:
        if block not in self._demands:
            self._demands[block] = Demand(self._image, self._chip, block, self._masks)
        return self._demands[block]

    def _slots(self, bounds: Mapping[int, list[int]]) -> np.ndarray:
        """(n_compartments,) what output axons take with these cuts."""
        pieces: dict[int, np.ndarray] = {}
        for block, ends in bounds.items():
            pieces |= self._demand(block).pieces_reached(ends)
        image, slots = self._image, self._uncut_slots.copy()
        per_axon = axon_slots(image, self._chip)
        for route in np.flatnonzero(image["route_input"] == 0):
            if (group := int(image["route_synapse"][route])) in pieces:
                axon = image["route_axon"][image.part("route_start", route)]
                more = np.where(axon >= 0, pieces[group][axon] - 1, 0) * per_axon[group]
                slots[image.part("block_start", image["route_source"][route])] += more
        return slots


def _stretches(demand: Demand, room: Capacity, slots: np.ndarray) -> list[int]:
    """The ends of pieces that each fit; none if one compartment alone does not."""
    ends = [0]
    while ends[-1] < demand.n:
        ends.append(demand.longest(ends[-1], slots, room))
        if ends[-1] == ends[-2]:
            return []
    return ends
