"""The host's spiking sources, on their way to the chip."""

import itertools
from collections.abc import Sequence

import numpy as np

from spikeport.backends.tape_kernel import list_spikes


class Outbox:
    """Finds which sources of each input spike.

    Parameters
    ----------
    values : (n,) array
        What the sources of all inputs put out, input after input: not zero where one spikes.
    sizes : sequence of int
        The number of sources of each input.

    Attributes
    ----------
    parts : list of (size,) array
        The values of each input.
    """

    def __init__(self, values: np.ndarray, sizes: Sequence[int]) -> None:
        self._values = values
        self._sizes = np.array(sizes, dtype=np.int64)
        self._spikes = np.zeros(len(values), dtype=np.int64)
        self._ends = np.zeros(len(sizes), dtype=np.int64)
        self.parts = np.split(values, np.cumsum(self._sizes)[:-1]) if len(sizes) else []

    def spikes(self) -> list[np.ndarray]:
        """The sources of each input that spike, in ascending order."""
        list_spikes(self._values, self._sizes, self._spikes, self._ends)
        ends = [0, *self._ends.tolist()]
        spikes = self._spikes[: ends[-1]].copy()  # a chip may keep them until its next step
        return [spikes[a:b] for a, b in itertools.pairwise(ends)]
