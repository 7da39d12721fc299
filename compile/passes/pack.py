"""`Pack`: several blocks on a core, within all limits of the chip."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.traffic import block_traffic
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.cut import cut
from spikeport.compile.placing.exact import pack_exactly
from spikeport.compile.placing.load import block_loads, capacity, core_loads
from spikeport.compile.placing.lower_bound import lower_bound, sums
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.compile.placing.search import Search
from spikeport.compile.placing.settling import settled
from spikeport.hardware_models.chip import ChipModel


@dataclass(frozen=True)
class Pack(ImagePass):
    """Put several blocks on a core, to use as few cores as can be found.

    Parameters
    ----------
    effort : int
        Effort of the search. 0: simple rules; 1: also try to empty cores; from 2 on, also cut
        blocks into pieces as small as 1 / effort of a core, if that saves cores.
    exact : bool
        True to search for the fewest cores that these blocks or pieces can take; for up to about
        100 of them.
    """

    effort: Annotated[int, Field(ge=0, le=16)] = 4
    exact: bool = False
    name: ClassVar[str] = "pack"
    precedes: ClassVar[tuple[str, ...]] = ("place",)

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Pack the blocks of an image, and cut them where that saves cores."""
        chip, problem = context.chip, _problem(image, context.chip)
        bins = pack(problem, self.effort)
        if self.exact:
            bins, at_least = pack_exactly(problem, bins)
            context.note("cores_at_least_uncut", at_least)
        packing = _on_cores(image, settled(problem, bins) if self.effort or self.exact else bins)
        fewest = max(sums(problem.loads, problem.room).values())
        search: Search | None = None
        tried: list[Mapping[int, list[int]]] = [{}]  # no cuts, as above
        # Try smaller pieces until the packing is known to be the smallest.
        for parts in range(2, self.effort + 1):
            if packing.n_cores > fewest:
                search = search or Search(image, chip)
                cuts = search.cuts(problem.room.nth_part(parts))
                # The same pieces would take the same number of cores.
                if cuts not in tried:
                    tried.append(cuts)
                    packing = self._cut_and_pack(image, chip, cuts, packing.n_cores) or packing
        context.note_change("cores", image.n_cores, packing.n_cores)
        context.note_change("blocks", image.n_blocks, packing.n_blocks)
        return packing

    def _cut_and_pack(
        self, image: ChipImage, chip: ChipModel, cuts: Mapping[int, list[int]], most: int
    ) -> ChipImage | None:
        """Cut blocks, pack the pieces, and join neighbours that share a core again.

        Return None if that does not take fewer cores than ``most``.
        """
        counts = [len(cuts.get(block, ())) + 1 for block in range(image.n_blocks)]
        pieces = cut(image, cuts)
        problem = _problem(pieces, chip)
        if lower_bound(problem.loads, problem.room)["cores"] >= most:
            return None
        bins = pack(problem, effort=1)
        if self.exact:
            bins = pack_exactly(problem, bins).bins
        if len(bins) >= most:
            return None
        pieces = _on_cores(pieces, settled(problem, bins))
        cores = np.split(pieces.blocks.core, np.cumsum(counts)[:-1])
        # Joined lists can take more memory: 124 synapses are stored as 64 and 60, not twice 62. And
        # lists that are cut again can take more on other cores: two words each in place of one.
        kept: set[int] = set()
        while True:
            joined = _join(image, cuts, cores, kept)
            crowded = _crowded(joined, chip)
            more = {block for block in cuts if not crowded.isdisjoint(cores[block].tolist())}
            if more <= kept:
                return joined
            kept |= more


def _problem(image: ChipImage, chip: ChipModel) -> Problem:
    return Problem(block_loads(image, chip), capacity(chip), block_traffic(image))


def _on_cores(image: ChipImage, bins: Bins) -> ChipImage:
    core = np.zeros(image.n_blocks, dtype=int)
    # Cores are sorted by their first blocks, so that equal packings give equal images.
    for number, blocks in enumerate(sorted(sorted(blocks) for blocks in bins)):
        core[blocks] = number
    return image.on_cores(core)


def _join(
    image: ChipImage,
    cuts: Mapping[int, Sequence[int]],
    cores: Sequence[np.ndarray],
    kept: Container[int] = (),
) -> ChipImage:
    """Cut only between pieces on different cores; keep all cuts of blocks in ``kept``."""
    ends, core = {}, []
    for block, mine in enumerate(cores):
        ends_core = np.ones(len(mine) - 1, bool) if block in kept else np.diff(mine) != 0
        ends[block] = np.array(cuts.get(block, ()), dtype=int)[ends_core].tolist()
        core.append(mine[np.append(True, ends_core)])
    return cut(image, ends).on_cores(np.concatenate(core))


def _crowded(image: ChipImage, chip: ChipModel) -> set[int]:
    """Return the cores that hold more than they have room for."""
    room = capacity(chip)
    return {core for core, load in enumerate(core_loads(image, chip)) if not room.holds(load)}
