"""`NativeChip`: an image on the compiled kernels."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from spikeport.backends.counter import make_activity
from spikeport.backends.native.kernel import (
    KEYS,
    LEARNING,
    Neurons,
    State,
    accept,
    deliver,
    gather,
    step,
    update,
)
from spikeport.backends.native.learning import Learning
from spikeport.backends.native.noise import Noise
from spikeport.backends.native.wiring import Wiring, wire
from spikeport.backends.readout import readout_compartments
from spikeport.compile.image import ChipImage
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import PER_STEP, Activity


class NativeChip:
    """An image on compiled kernels. Implements `spikeport.backends.chip.Chip`.

    Its state is equal to that of nengo-loihi's emulator after every step, in every bit.

    Parameters
    ----------
    image : ChipImage
        What to run.
    seed : int
        Seed of noise and of the rounding of learned weights.
    """

    def __init__(self, image: ChipImage, seed: int) -> None:
        self._image = image
        self._wiring = wire(image)
        self._neurons = neurons(image)
        self.state = resting_state(image, self._wiring)
        rng = np.random.RandomState(seed)
        self._learning = Learning(image, self._wiring, rng)
        self._noise = Noise(image, rng, drawn_anyway=self._learning.active)
        self._n_arriving = 0
        sizes = image["input_size"]
        firsts = image.n_compartments + np.cumsum(sizes) - sizes
        self._inputs = list(zip(firsts.tolist(), sizes.tolist(), strict=True))
        self._pending = np.zeros(sizes.sum(), dtype=np.int64)
        self._counts: list[np.ndarray] = []
        self._held = np.zeros(len(image["output_compartment"]), dtype=np.int32)
        parts = [image.part("output_start", i) for i in range(len(image.manifest["outputs"]))]
        self._views = [self._held[part] for part in parts]
        self._closed = False

    def step(
        self, spikes: Sequence[np.ndarray], errors: Mapping[int, np.ndarray]
    ) -> list[np.ndarray]:
        """See `spikeport.backends.chip.Chip.step`."""
        if self._closed:
            raise BackendError("the chip is closed: it cannot step any more")
        n_accepted = self._accept(spikes)
        self._learning.check(errors)
        counts = np.zeros((len(PER_STEP), self._image.n_cores), dtype=np.int64)
        if self._learning.active:
            self._step_learning(counts, errors)
        else:
            self._n_arriving = step(
                self._wiring,
                self._neurons,
                self.state,
                self._n_arriving,
                self._noise.draw(),
                counts,
                self._held,
            )
        self._counts.append(counts)
        # The host's spikes queue behind the chip's own: they arrive in the next step.
        end = self._n_arriving + n_accepted
        self.state.arriving[self._n_arriving : end] = self._pending[:n_accepted]
        self._n_arriving = end
        return self._views

    def _accept(self, spikes: Sequence[np.ndarray]) -> int:
        """Put the host's spikes aside; returns how many. Refuses any that no input has."""
        if len(spikes) != len(self._inputs):
            raise BackendError(f"spikes of {len(spikes)} inputs; the image has {len(self._inputs)}")
        n = 0
        for i, (sources, (first, size)) in enumerate(zip(spikes, self._inputs, strict=True)):
            if len(sources):
                array = np.asarray(sources)
                if array.ndim != 1 or array.dtype.kind not in "iu":
                    raise BackendError(
                        f"input {i}: its spikes are {array.dtype} of shape {array.shape}; "
                        "give the numbers of the sources that spike, as a (n,) array of integers"
                    )
                n = accept(array, first, size, self._pending, n)
                if n < 0:
                    given = f"{len(array)} spikes of sources {array.min()} to {array.max()}"
                    raise BackendError(
                        f"input {i}: {given}; it has {size}, counted from 0, "
                        "of which each can spike once in a step"
                    )
        return n

    def _step_learning(self, counts: np.ndarray, errors: Mapping[int, np.ndarray]) -> None:
        """A step in parts: weights change between the delivery of spikes and the update."""
        touched = deliver(self._wiring, self.state, self._n_arriving, counts)
        counts[LEARNING] = self._learning.step(self.state.touched[:touched], errors)
        self._n_arriving = update(self._neurons, self.state, self._noise.draw(), counts)
        gather(self._neurons, self.state, self._held)

    def activity(self) -> Activity:
        """See `spikeport.backends.chip.Chip.activity`."""
        image = self._image
        return make_activity(
            image.cores,
            image.manifest["dt_s"],
            self._counts,
            self._messages(),
            int(self.state.readout_spikes[0]),
        )

    def _messages(self) -> tuple[np.ndarray, np.ndarray]:
        """Messages of the run from core to core, and from the host to each core."""
        start, core, n = self._wiring.reached_start, self._wiring.reached_core, self._image.n_cores
        source = np.repeat(np.arange(len(start) - 1), np.diff(start))
        sent = self.state.delivered[source]
        host = source >= self._image.n_compartments
        messages, from_host = np.zeros((n, n), np.int64), np.zeros(n, np.int64)
        np.add.at(messages, (self._image.compartment_core[source[~host]], core[~host]), sent[~host])
        np.add.at(from_host, core[host], sent[host])
        return messages, from_host

    def close(self) -> None:
        """See `spikeport.backends.chip.Chip.close`."""
        self._closed = True


def neurons(image: ChipImage) -> Neurons:
    """The constants of an image's compartments."""
    biased = image["bias"] != 0
    starts = image["block_start"]
    reads = np.diff(image["output_start"])
    return Neurons(
        block_start=starts,
        block_core=image["block_core"],
        vmin=image["block_vmin"],
        vmax=image["block_vmax"],
        bias=image["bias"],
        keep_u=4095 - image["decay_u"],
        keep_v=4096 - image["decay_v"],
        vth=image["vth"],
        refract=image["refract_delay"],
        core=image.compartment_core,
        always_active=np.array([biased[a:b].all() for a, b in itertools.pairwise(starts)]),
        readout=readout_compartments(image),
        read=image["output_compartment"],
        read_key=np.repeat([KEYS.index(o["key"]) for o in image.manifest["outputs"]], reads),
    )


def resting_state(image: ChipImage, wiring: Wiring) -> State:
    """All state at zero."""
    n = image.n_compartments
    n_sources = len(wiring.delivery_start) - 1
    return State(
        q=np.zeros(n, dtype=np.int32),
        u=np.zeros(n, dtype=np.int32),
        v=np.zeros(n, dtype=np.int32),
        refractory=np.zeros(n, dtype=np.int32),
        spiked=np.zeros(n, dtype=np.int32),
        spike_count=np.zeros(n, dtype=np.int32),
        arriving=np.zeros(n_sources, dtype=np.int64),
        spikes_of=np.zeros(len(wiring.place), dtype=np.int32),
        touched=np.zeros(len(wiring.place), dtype=np.int32),
        delivered=np.zeros(n_sources, dtype=np.int64),
        readout_spikes=np.zeros(1, dtype=np.int64),
    )
