"""`Split`: blocks that no core can hold are cut into pieces that cores can."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spikeport.compile.image import ChipImage
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.cut import can_cut, cut
from spikeport.compile.placing.demand import Demand
from spikeport.compile.placing.load import Capacity, ProfileMasks, block_loads, capacity
from spikeport.compile.usage import axon_slots, out_slots
from spikeport.hardware_models.chip import Chip


@dataclass(frozen=True)
class Split(ImagePass):
    """Cut blocks that exceed what a core has, at their compartments, source and target together.

    A block that learns, has population axons, or of which one compartment alone is too much for a
    core is left as it is.
    """

    name: ClassVar[str] = "split"
    precedes: ClassVar[tuple[str, ...]] = ("pack", "place")

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """See `ImagePass.apply`."""
        bounds = find_bounds(image, context.chip, capacity(context.chip))
        cuts = {block: ends[1:-1] for block, ends in bounds.items()}
        labels = [entry["label"] for entry in image.manifest["blocks"]]
        context.note("pieces", {labels[block]: len(c) + 1 for block, c in cuts.items()})
        return cut(image, cuts) if cuts else image


def find_bounds(image: ChipImage, chip: Chip, room: Capacity) -> dict[int, list[int]]:
    """Where to cut the blocks that are too large: the ends of their pieces, from 0 to the last.

    Each piece is as long as there is room for. A target in pieces takes more of the output axons
    of its sources, so cuts are sought again until nothing changes; slots are never given back,
    which ends the search.
    """
    search = _Search(image, chip, room)
    bounds: dict[int, list[int]] = {}
    while (found := search.bounds()) != bounds:
        bounds = found
        search.count_slots(bounds)
    return bounds


class _Search:
    """One search for cuts; ``slots`` are what the output axons of each compartment take."""

    def __init__(self, image: ChipImage, chip: Chip, room: Capacity) -> None:
        self._image, self._chip, self._room = image, chip, room
        self._loads = block_loads(image, chip)
        self._masks, self._cuttable = ProfileMasks(image), can_cut(image)
        self._demands: dict[int, Demand] = {}
        self._uncut_slots = self._slots = out_slots(image, chip)

    def bounds(self) -> dict[int, list[int]]:
        """Where to cut, as far as is known."""
        too_large = [b for b in np.flatnonzero(self._cuttable).tolist() if not self._fits(b)]
        found = {block: self._stretches(self._demand(block)) for block in too_large}
        return {block: ends for block, ends in found.items() if ends}

    def _fits(self, block: int) -> bool:
        compartments, in_axons, _, bits = self._loads[block].amounts
        out = int(self._slots[self._image.part("block_start", block)].sum())
        load = self._loads[block]._replace(amounts=(compartments, in_axons, out, bits))
        return self._room.holds(load)

    def _demand(self, block: int) -> Demand:
        if block not in self._demands:
            self._demands[block] = Demand(self._image, self._chip, block, self._masks)
        return self._demands[block]

    def _stretches(self, demand: Demand) -> list[int]:
        """The ends of pieces that each fit; none if one compartment alone does not."""
        ends = [0]
        while ends[-1] < demand.n:
            ends.append(demand.longest(ends[-1], self._slots, self._room))
            if ends[-1] == ends[-2]:
                return []
        return ends

    def count_slots(self, bounds: Mapping[int, list[int]]) -> None:
        """Count output axons with these cuts; no compartment takes fewer than before."""
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
        self._slots = np.maximum(self._slots, slots)
