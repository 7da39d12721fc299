"""Runs of blocks on recorded spikes of a host, and comparison of their outputs."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.signal import lfilter

from spikeport.backends.float_chip import FloatChip
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compile.loihi.numbers import Numbers
from spikeport.errors import BackendError

TAU_S = 0.02
"""Time constant of the filter that outputs are compared through."""
READ = ("voltage", "spiked")
"""States of a compartment that can be compared."""


class Rerun:
    """The outputs of an image on recorded spikes of its host.

    Parameters
    ----------
    image : ChipImage
        The image before any pass changed it.
    spikes : sequence of (n,) int array
        For every step, the sources that spiked on the host, numbered through all inputs.

    Raises
    ------
    BackendError
        If blocks learn or have noise, which cannot be run again, or no output can be compared.
    """

    def __init__(self, image: ChipImage, spikes: Sequence[np.ndarray]) -> None:
        check(image)
        self._image, self._spikes = image, spikes
        self._compared = _compared(image)
        self._chip = FloatChip(image)

    def floats(self, numbers: Numbers) -> np.ndarray:
        """Return the filtered outputs in floating point, in the chip's units, (n_steps, n)."""
        rows = (
            self._held(voltage * numbers.to_integers, spiked)
            for voltage, spiked in self._chip.run(numbers, self._spikes)
        )
        return self._filtered(rows)

    def integers(self) -> np.ndarray:
        """Return the filtered outputs of the image itself, (n_steps, n)."""
        # Any seed will do: images that draw random numbers are refused.
        chip = NativeChip(self._image, seed=0)
        rows = (
            [np.array(part, dtype=float) for part in chip.step(step, {})] for step in self._spikes
        )
        return self._filtered(rows)

    def _held(self, voltage: np.ndarray, spiked: np.ndarray) -> list[np.ndarray]:
        state = {"voltage": voltage, "spiked": spiked.astype(float)}
        return [
            state.get(output.key, voltage)[self._image.read_by(i)]
            for i, output in enumerate(self._image.manifest.outputs)
        ]

    def _filtered(self, rows: Iterable[list[np.ndarray]]) -> np.ndarray:
        """Decode the states that outputs held, and filter the values."""
        decoded = np.array([self._decoded(row) for row in rows])
        return low_pass(decoded, self._image.manifest.dt_s)

    def _decoded(self, row: list[np.ndarray]) -> np.ndarray:
        parts = []
        for i in self._compared:
            output = self._image.manifest.outputs[i]
            weights = self._image.decoders.weight[part(self._image.outputs.weight_start, i)]
            matrix = weights.reshape(output.shape) if output.weights == "matrix" else None
            parts.append(row[i] if matrix is None else row[i] @ matrix)
        return np.concatenate(parts)


def _compared(image: ChipImage) -> list[int]:
    """Return the outputs to compare: spikes and decoded values; without these, voltages."""
    outputs = image.manifest.outputs
    read = [i for i, output in enumerate(outputs) if output.key in READ]
    # Raw voltages have up to 24 bits: decoded values would not count in one error with them.
    small = [i for i in read if outputs[i].key == "spiked" or outputs[i].weights == "matrix"]
    return small or read


def check(image: ChipImage) -> None:
    """Refuse an image that cannot be run again, or has nothing to compare.

    Raises
    ------
    BackendError
        If blocks learn or have noise, or no output can be compared.
    """
    if image.learns.any() or image.compartments.enable_noise.any():
        raise BackendError(
            "cannot measure the loss of a network that learns or has noise on the chip: "
            "every run differs; compile it without --loss"
        )
    if not _compared(image):
        raise BackendError(
            "loss is measured on outputs of spikes, decoded values or voltages, and the network "
            "has none; add a probe"
        )


def low_pass(values: np.ndarray, dt_s: float) -> np.ndarray:
    """Filter values, (n_steps, n), with the time constant that outputs are compared through."""
    decay = np.exp(-dt_s / TAU_S)
    result: np.ndarray = lfilter([1 - decay], [1, -decay], values, axis=0)
    return result
