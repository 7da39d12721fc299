"""`Split`: blocks that no core can hold are cut into pieces that cores can."""

from dataclasses import dataclass
from typing import ClassVar

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.cut import cut
from spikeport.compile.placing.load import capacity
from spikeport.compile.placing.search import Search


@dataclass(frozen=True)
class Split(ImagePass):
    """Cut blocks that exceed what a core has, at their compartments, source and target together.

    A block that learns, has population axons, or of which one compartment alone is too much for a
    core is left as it is.
    """

    name: ClassVar[str] = "split"
    precedes: ClassVar[tuple[str, ...]] = ("pack", "place")

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Cut the blocks that no core can hold."""
        bounds = Search(image, context.chip).bounds(capacity(context.chip))
        cuts = {block: ends[1:-1] for block, ends in bounds.items()}
        labels = [entry.label for entry in image.manifest.blocks]
        context.note("pieces", {labels[block]: len(c) + 1 for block, c in cuts.items()})
        return cut(image, cuts) if cuts else image
