"""A chip that records the spikes of its host."""

from collections.abc import Mapping

import numpy as np

from spikeport.backends.chip import Chip
from spikeport.hardware_models.activity import Activity


class Recorder:
    """A recorder between host and chip. Implements `spikeport.backends.chip.Chip`.

    ``spikes`` holds the spikes of every step.
    """

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self.spikes: list[np.ndarray] = []

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the chip's link; see `spikeport.backends.chip.Chip.link`."""
        return self._chip.link

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Record the spikes, and step the chip; see `spikeport.backends.chip.Chip.step`."""
        self.spikes.append(np.array(spikes, dtype=np.int64))
        return self._chip.step(spikes, errors)

    def activity(self) -> Activity:
        """Return the chip's counts; see `spikeport.backends.chip.Chip.activity`."""
        return self._chip.activity()

    def close(self) -> None:
        """Free the chip; see `spikeport.backends.chip.Chip.close`."""
        self._chip.close()
