"""The chip's noise, drawn as nengo-loihi's emulator draws it."""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage

NONE = np.zeros((2, 0), dtype=np.int32)


class Noise:
    """Noise of all compartments, from one stream.

        noise = (r + 64 offset) 2^(exp - 7),  r uniform in -127 .. 127,  0 where it is not enabled

    Parameters
    ----------
    image : ChipImage
        The image, with the exponents and offsets of its noise.
    rng : np.random.RandomState
        The chip's stream, shared with learning.
    drawn_anyway : bool
        True if the stream must advance even where no compartment has noise.
    """

    def __init__(self, image: ChipImage, rng: np.random.RandomState, drawn_anyway: bool) -> None:
        sizes = np.diff(image.blocks.start)
        exponent = np.repeat(image.blocks.noise_exp, sizes)
        self._offset = np.repeat(image.blocks.noise_offset, sizes) * np.int32(64)
        self._scale = np.where(image.compartments.enable_noise == 1, 2.0 ** (exponent - 7), 0)
        self._on_u = np.repeat(image.blocks.noise_at_membrane, sizes) == 1
        self._heard = bool(self._scale.any())
        self._drawn = drawn_anyway or self._heard
        self._rng = rng

    def draw(self) -> np.ndarray:
        """Return this step's noise on q and on u, (2, n_compartments); (2, 0) without noise."""
        if not self._drawn:
            return NONE
        uniform = self._rng.randint(-127, 128, size=len(self._offset), dtype=np.int32)
        # The stream had to advance, but there is no noise to add.
        if not self._heard:
            return NONE
        # The conversion cuts towards zero, as the emulator's does.
        noise = ((uniform + self._offset) * self._scale).astype(np.int32)
        return np.stack([np.where(self._on_u, 0, noise), np.where(self._on_u, noise, 0)])
