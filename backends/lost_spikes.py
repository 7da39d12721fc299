"""Spikes that sources on the host could not send, as the chip takes one of each in a step."""

import itertools

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import offsets
from spikeport.compiled import compiled, make_ready


class LostSpikes:
    """A count of the steps in which sources on the host had to spike more than once.

    Parameters
    ----------
    image : ChipImage
        The image that the sources send to.
    sources : (n_inputs,) array
        The present output of each source: its spikes in the step, divided by dt.
    """

    def __init__(self, image: ChipImage, sources: np.ndarray) -> None:
        self._image, self._sources = image, sources
        self._steps = np.zeros(image.n_inputs, dtype=np.int64)
        self._limit = 1.5 / image.manifest.dt_s  # between the outputs of one spike and of two
        self._count = make_ready(_count_above, self._steps, self._sources, self._limit)

    def count(self) -> None:
        """Count the present step for each source that has to spike more than once in it."""
        self._count(self._steps, self._sources, self._limit)

    def by_input(self) -> dict[str, int]:
        """Return the steps so far, by the input's name; see `Activity.cut_off`."""
        ends = offsets(self._image.inputs.size)
        return {
            _name(self._image, i): int(self._steps[a:b].max(initial=0))
            for i, (a, b) in enumerate(itertools.pairwise(ends))
            if self._image.manifest.inputs[i].encoding.kind != "spikes"  # these stand for no value
        }


@compiled
def _count_above(counts: np.ndarray, values: np.ndarray, limit: float) -> None:
    """Add 1 to the count of each value above a limit."""
    for i in range(len(values)):
        counts[i] += values[i] > limit


def _name(image: ChipImage, number: int) -> str:
    """Return the name of an input: its connection, or its node with the blocks that it reaches."""
    if " -> " in (name := image.manifest.inputs[number].name):
        return name
    routes = np.flatnonzero((image.routes.from_input == 1) & (image.routes.source == number))
    blocks = image.groups.block[image.routes.group[routes]]
    reached = dict.fromkeys(image.manifest.blocks[block].label for block in blocks)
    return f"{name} to {', '.join(reached)}"
