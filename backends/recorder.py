"""A chip that notes what the host sends it."""

from collections.abc import Mapping

import numpy as np

from spikeport.backends.chip import Chip
from spikeport.hardware_models.activity import Activity


class Recorder:
    """Passes everything on to a chip. Implements `spikeport.backends.chip.Chip`.

    ``spikes`` holds the spikes of every step.
    """

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self.spikes: list[np.ndarray] = []

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """See `spikeport.backends.chip.Chip.step`."""
        self.spikes.append(np.array(spikes, dtype=np.int64))
        return self._chip.step(spikes, errors)

    def activity(self) -> Activity:
        """See `spikeport.backends.chip.Chip.activity`."""
        return self._chip.activity()

    def close(self) -> None:
        """See `spikeport.backends.chip.Chip.close`."""
        self._chip.close()
