"""Blocks in floating point, as nengo-loihi's emulator computes them when nothing is rounded.

    I <- (1 - d_u) I + s_u q,   v <- clip((1 - d_v) v + s_v (I + b), vmin, vmax)

where q is the sum of the weights that spikes of the previous step read, and s is d if a block
scales its input, else 1. A neuron above threshold spikes, and stays at 0 while it is refractory.

Source: nengo-loihi 1.1.0, emulator/interface.py, at floating-point blocks.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import synapses_of
from spikeport.compile.image.tables import offsets, ranges
from spikeport.compile.loihi.numbers import Numbers


class FloatChip:
    """The wiring of an image, run with floating-point numbers.

    Parameters
    ----------
    image : ChipImage
        The wiring before any pass changed it, without learning and noise.
    """

    def __init__(self, image: ChipImage) -> None:
        self._n = image.n_compartments
        self._refract = image.compartments.refract_delay.astype(np.int64)
        parts = list(synapses_of(image))
        source, target, number = (
            np.concatenate([*(part[i] for part in parts), np.zeros(0, int)]) for i in range(3)
        )
        order = np.argsort(source, kind="stable")
        self._target, self._number = target[order], number[order]
        self._start = offsets(np.bincount(source, minlength=image.n_sources))

    def run(
        self, numbers: Numbers, spikes: Sequence[np.ndarray]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the state after each step of a run that starts at rest.

        Parameters
        ----------
        numbers : Numbers
            Weights and neurons.
        spikes : sequence of (n,) int array
            For each step, the sources that spike on the host; the spikes arrive one step later.

        Yields
        ------
        voltage, spiked : (n_compartments,) float and bool array
            The state after each step, in the numbers' units.
        """
        weights = numbers.weights[self._number]
        keep_u, keep_v = 1 - numbers.decay_u, 1 - numbers.decay_v
        into_u = np.where(numbers.scale_u, numbers.decay_u, 1.0)
        into_v = np.where(numbers.scale_v, numbers.decay_v, 1.0)
        current, voltage = np.zeros(self._n), np.zeros(self._n)
        resting = np.zeros(self._n, dtype=np.int64)
        arriving = np.zeros(0, dtype=np.int64)
        for from_host in spikes:
            current = keep_u * current + into_u * self._delivered(arriving, weights)
            voltage = keep_v * voltage + into_v * (current + numbers.bias)
            voltage = np.clip(voltage, numbers.vmin, numbers.vmax)
            voltage[resting > 0] = 0
            spiked = voltage > numbers.vth
            voltage[spiked] = 0
            resting = np.maximum(np.where(spiked, self._refract, resting) - 1, 0)
            arriving = np.concatenate([np.flatnonzero(spiked), self._n + from_host])
            yield voltage, spiked

    def _delivered(self, sources: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the sum of the weights that spikes of the sources read, (n_compartments,)."""
        synapses = ranges(self._start[sources], np.diff(self._start)[sources])
        return np.bincount(self._target[synapses], weights[synapses], minlength=self._n)
