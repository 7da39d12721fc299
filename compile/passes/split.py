"""`Split`: blocks that are too large for a core are cut into pieces that fit."""

from dataclasses import dataclass
from typing import ClassVar

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.cut import cut
from spikeport.compile.placing.load import capacity
from spikeport.compile.placing.search import Search


@dataclass(frozen=True)
class Split(ImagePass):
    """Cut blocks that are too large for a core into pieces: ranges of their compartments.

    A block stays as it is if it learns, has population axons, or has a compartment that alone is
    too large for a core.
    """

    name: ClassVar[str] = "split"
    precedes: ClassVar[tuple[str, ...]] = ("pack", "place")

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Cut the blocks that no core can hold."""
        cuts = Search(image, context.chip).cuts(capacity(context.chip))
        labels = [entry.label for entry in image.manifest.blocks]
        context.note("pieces", {labels[block]: len(c) + 1 for block, c in cuts.items()})
        return cut(image, cuts) if cuts else image
