"""A chip that notes what the host sends it."""

from collections.abc import Mapping, Sequence

import numpy as np

from spikeport.backends.chip import Chip
from spikeport.hardware_models.activity import Activity


class Recorder:
    """Passes everything on to a chip. Implements `spikeport.backends.chip.Chip`.

    ``spikes`` holds, for every step, the spikes of every input.
    """

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self.spikes: list[list[np.ndarray]] = []

    def step(
        self, spikes: Sequence[np.ndarray], errors: Mapping[int, np.ndarray]
    ) -> list[np.ndarray]:
        """See `spikeport.backends.chip.Chip.step`."""
        self.spikes.append([np.array(part, dtype=np.int64) for part in spikes])
        return self._chip.step(spikes, errors)

    def activity(self) -> Activity:
        """See `spikeport.backends.chip.Chip.activity`."""
        return self._chip.activity()

    def close(self) -> None:
        """See `spikeport.backends.chip.Chip.close`."""
        self._chip.close()
