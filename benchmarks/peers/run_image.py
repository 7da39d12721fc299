"""An image on spikeport's native chip, or on nengo-loihi's emulator without our counts.

The third argument is the image, the fourth ``native`` or ``nengo-loihi``.
"""

import sys
from importlib.metadata import version

import numpy as np
from traffic import Running, Traffic, contest

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage

NOTHING = np.zeros(0, dtype=np.int64)


class SpikeCounter(NengoLoihiChip):
    """nengo-loihi's emulator as its users run it; only spikes are counted.

    `speed.Emulator`, which counts nothing, is in a folder that these scripts cannot import from.
    """

    def _count(self, _spikes):
        self.spike_count += self._emulator.compartment.spiked


def native(image):
    """Return a native chip, and a function for its spike counts."""
    chip = NativeChip(image, seed=0)
    return chip, lambda: chip.state.spike_count


def emulator(image):
    """Return nengo-loihi's emulator, and a function for its spike counts."""
    chip = SpikeCounter(image, seed=0)
    chip.spike_count = np.zeros(image.n_compartments, dtype=int)
    return chip, lambda: chip.spike_count


def build(_traffic: Traffic) -> Running:
    """Load the image, which holds the same network."""
    image = ChipImage.load(sys.argv[3])
    chip, spikes = {"native": native, "nengo-loihi": emulator}[sys.argv[4]](image)

    def run(steps: int) -> None:
        for _ in range(steps):
            chip.step(NOTHING, {})

    return Running(run, spikes)


package = {"native": "spikeport", "nengo-loihi": "nengo-loihi"}[sys.argv[4]]
contest(f"{package} {version(package)}", build)
