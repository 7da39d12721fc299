"""The chip step in plain NumPy: what every backend must compute, written to be read.

A step has five phases: deliver, integrate, leak, fire, rest. Widths, sign included:

    q   22 bits   input of a compartment in this step         wraps
    u   24 bits   current, a low-pass of q                    wraps; u + bias (+ noise) wraps too
    v   32 bits   voltage, a low-pass of u                    wraps, then is clipped to vmin .. vmax
    decay 12 bits, refractory delay 6 bits, weights any that fit into 32 bits

Learning is left out; noise is not.
"""

import itertools
from collections.abc import Mapping

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part


def wrap(x: np.ndarray, bits: int) -> np.ndarray:
    """Return x as a register of this many bits holds it, in two's complement."""
    half = 1 << (bits - 1)
    return (x + half) % (2 * half) - half


def decay(x: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Return x keep / 4096, rounded towards zero."""
    return np.sign(x) * ((np.abs(x) * keep) >> 12)


class Oracle:
    """An image at rest. Implements `step` of `spikeport.backends.chip.Chip`; state is int64."""

    offset_u, offset_v = 1, 0  # nengo-loihi's current decays by one 4096th more than set

    def __init__(self, image: ChipImage, seed: int) -> None:
        if image.learns.any():
            raise NotImplementedError("the oracle does not learn")
        self.image, self.rng = image, np.random.RandomState(seed)
        n = image.n_compartments
        self.q, self.u, self.v, self.refractory, self.spike_count = np.zeros((5, n), dtype=np.int64)
        self.spiked = np.zeros(n, dtype=bool)
        self.block = image.compartment_block
        self.host_spikes = [np.zeros(0, dtype=int) for _ in image.inputs.size]

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; host spikes are delivered in the next one."""
        on_q, on_u = self._noise()
        self._deliver()
        self._integrate(on_q)
        self._leak(on_u)
        self._fire()
        self._rest()
        ends = itertools.pairwise([0, *np.cumsum(self.image.inputs.size)])
        given = np.asarray(spikes, dtype=int)
        self.host_spikes = [given[(given >= a) & (given < b)] - a for a, b in ends]
        return [self._read(i) for i in range(len(self.image.outputs))]

    def _deliver(self) -> None:
        """Add the weights of the rows that routes reach, for every spike of the previous step."""
        self.q[:] = 0
        for route, of_input in enumerate(self.image.routes.from_input):
            number = self.image.routes.source[route]
            start = self.image.blocks.start[0 if of_input else number]
            end = self.image.blocks.start[0 if of_input else number + 1]
            sources = np.flatnonzero(self.spiked[start:end])
            for source in self.host_spikes[number] if of_input else sources:
                self._deliver_one(route, source)

    def _deliver_one(self, route: int, source: int) -> None:
        image, place = self.image, part(self.image.routes.start, route).start + source
        axon, atom = image.out_axons.axon[place], image.out_axons.atom[place]
        group = image.routes.group[route]
        base = image.in_axons.base[image.groups.axon_start[group] + axon]
        if axon < 0 or base < 0:
            return
        row = (
            image.groups.row_start[group]
            + image.in_axons.row[image.groups.axon_start[group] + axon]
        )
        mine, shape = part(image.rows.start, row), (image.rows.atoms[row], -1)
        weights = image.synapses.weight[mine].reshape(shape)[atom]
        targets = image.synapses.index[mine].reshape(shape)[atom]
        first = image.blocks.start[image.groups.block[group]] + base
        last_of_each = dict(zip(targets.tolist(), weights.tolist(), strict=True))
        for target, weight in last_of_each.items():
            self.q[first + target] += weight

    def _noise(self) -> tuple[np.ndarray, np.ndarray]:
        image, block = self.image, self.block
        uniform = self.rng.randint(-127, 128, size=len(block), dtype=np.int32)
        scale = 2.0 ** (image.blocks.noise_exp - 7)[block] * (image.compartments.enable_noise == 1)
        noise = ((uniform + 64 * image.blocks.noise_offset[block]) * scale).astype(np.int64)
        on_u = image.blocks.noise_at_membrane[block] == 1
        return np.where(on_u, 0, noise), np.where(on_u, noise, 0)

    def _integrate(self, noise: np.ndarray) -> None:
        self.q = wrap(self.q + noise, bits=22)
        keep = 4096 - self.offset_u - self.image.compartments.decay_u
        self.u = wrap(decay(self.u, keep) + self.q, bits=24)

    def _leak(self, noise: np.ndarray) -> None:
        total = wrap(self.u + self.image.compartments.bias + noise, bits=24)
        keep = 4096 - self.offset_v - self.image.compartments.decay_v
        self.v = wrap(decay(self.v, keep) + total, bits=32)

    def _fire(self) -> None:
        vmin, vmax = self.image.blocks.vmin[self.block], self.image.blocks.vmax[self.block]
        self.v = np.where(self.refractory > 0, 0, np.clip(self.v, vmin, vmax))
        self.spiked = self.v > self.image.compartments.vth
        self.v[self.spiked] = 0

    def _rest(self) -> None:
        left = np.where(self.spiked, self.image.compartments.refract_delay, self.refractory)
        self.refractory = np.maximum(left - 1, 0)
        self.spike_count += self.spiked

    def _read(self, output: int) -> np.ndarray:
        held = {"voltage": self.v, "current": self.u, "spiked": self.spiked}
        key = self.image.manifest.outputs[output].key
        return held[key][self.image.reads.compartment[part(self.image.outputs.start, output)]]
