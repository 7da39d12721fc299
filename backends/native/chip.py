"""`NativeChip`: an image on the compiled kernels."""

from collections.abc import Mapping

import numpy as np

from spikeport.backends.chip import CLOSED, Decoding, Joined
from spikeport.backends.host_checks import HostChecks, out_of_range
from spikeport.backends.native.kernel import LEARNING, accept, deliver, exchange, step, update
from spikeport.backends.native.learning import Learning
from spikeport.backends.native.loaded import Host, Loaded, State, neurons_of, resting_state
from spikeport.backends.native.noise import NONE, Noise
from spikeport.backends.native.shards import Threads
from spikeport.backends.native.wiring import Wiring, line_up, wire
from spikeport.backends.step_log import SUMS_ONLY, LogOptions, MessageCounts, StepLog, Totals
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compiled import make_ready
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import PER_STEP, Activity

NO_CORES = np.zeros(0, dtype=int)


class NativeChip:
    """An image on compiled kernels. Implements `spikeport.backends.chip.Chip`.

    Its state is equal to that of nengo-loihi's emulator after every step, in every bit.

    Parameters
    ----------
    image : ChipImage
        The image to run.
    seed : int
        Seed of noise and of the rounding of learned weights.
    log : LogOptions
        See `StepLog`.
    threads : int
        The number of threads that the cores are divided among; an image that learns uses one.
    """

    link: dict[str, object] | None = None

    def __init__(
        self, image: ChipImage, seed: int, log: LogOptions = SUMS_ONLY, threads: int = 1
    ) -> None:
        self._image = image.checked
        is_divided = min(threads, image.n_cores) > 1 and not image.learns.any()
        # With threads, each thread has its own wiring.
        wiring = wire(image, NO_CORES if is_divided else None)
        # An image that learns keeps its weights in their order.
        self._wiring = wiring if image.learns.any() else line_up(wiring)
        self.state = resting_state(image, self._wiring)
        self._neurons = neurons_of(image)
        self._loaded = Loaded(self._wiring, self._neurons, self.state)
        self._threads = Threads(image, self.state, self._neurons, threads) if is_divided else None
        rng = np.random.RandomState(seed)
        self._learning = _learning(image, self._wiring, rng)
        self._checks = HostChecks(image)
        # Noise and learning draw from one stream, as in the emulator. So an image that learns also
        # draws noise that no compartment uses.
        self._noise = Noise(image, rng, drawn_anyway=self._learning is not None)
        self._n_arriving = 0
        self.log = StepLog(image.cores, image.manifest.dt_s, self._totals, log)
        self._counted = len(PER_STEP), image.n_cores
        parts = [part(image.outputs.start, i) for i in range(len(image.manifest.outputs))]
        self._views = [self.state.held[part] for part in parts]
        self._closed = False
        self._make_ready()

    def _make_ready(self) -> None:
        """Compile at construction, so that the first step does not wait for it."""
        no_spikes, no_counts = np.zeros(0, dtype=np.int64), np.zeros((0, 0), dtype=np.int64)
        if self._learning is not None:
            make_ready(accept, self._loaded, no_spikes)
            make_ready(deliver, self._loaded, 0, no_counts)
            make_ready(update, self._loaded, 0, NONE, no_counts)
        elif self._threads is None:
            make_ready(step, self._loaded, 0, no_spikes, NONE, no_counts)

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        self._check_open()
        sources = self._checks.sources(spikes)
        if len(sources) > len(self.state.pending):
            self._make_room(len(sources))
        counts = np.zeros(self._counted, dtype=np.int64)
        self._checks.check_errors(errors)
        if self._learning is None:
            n_arriving = self._step(sources, self._noise.draw(), counts)
        else:
            n_arriving = self._step_learning(self._learning, sources, counts, errors)
        if n_arriving < 0:
            raise out_of_range(sources, self._image.n_inputs)
        self._n_arriving = n_arriving
        self.log.append(counts, len(sources))
        return self._views

    def _step(self, sources: np.ndarray, noise: np.ndarray, counts: np.ndarray) -> int:
        if self._threads is not None:
            self._checks.check_range(sources)
            return self._threads.step(self._n_arriving, sources, noise, counts)
        return step(self._loaded, self._n_arriving, sources, noise, counts)

    def join(self, sources: np.ndarray, decoding: Decoding, inbox: np.ndarray) -> Joined | None:
        """Return a step in one call; see `spikeport.backends.chip.Joinable.join`."""
        if self._learning is not None or self._threads is not None:
            return None
        host = Host(sources, *decoding, inbox)
        no_counts = np.zeros((0, 0), dtype=np.int64)
        run = make_ready(exchange, self._loaded, 0, host, NONE, no_counts)

        def step_joined() -> tuple[list[np.ndarray], bool]:
            self._check_open()
            counts, noise = np.zeros(self._counted, dtype=np.int64), self._noise.draw()
            self._n_arriving, n_sent, decoded = run(
                self._loaded, self._n_arriving, host, noise, counts
            )
            self.log.append(counts, n_sent)
            return self._views, decoded

        return step_joined

    def _check_open(self) -> None:
        if self._closed:
            raise BackendError(CLOSED)

    def _make_room(self, n: int) -> None:
        """Make room for n spikes of the host in a step: a source may spike more than once."""
        more = 2 * n - len(self.state.pending)
        self.state = self.state._replace(
            # Twice the size needed, so that this happens seldom.
            pending=np.zeros(2 * n, dtype=np.int32),
            arriving=np.append(self.state.arriving, np.zeros(more, dtype=np.int32)),
        )
        self._loaded = Loaded(self._wiring, self._neurons, self.state)

    def _step_learning(
        self,
        learning: Learning,
        sources: np.ndarray,
        counts: np.ndarray,
        errors: Mapping[int, np.ndarray],
    ) -> int:
        """Step in parts: weights change between the delivery of spikes and the update."""
        n_pending = accept(self._loaded, sources)
        if n_pending < 0:
            return -1
        n = deliver(self._loaded, self._n_arriving, counts)
        counts[LEARNING] = learning.step(self.state.touched[:n], errors)
        return update(self._loaded, n_pending, self._noise.draw(), counts)

    def activity(self) -> Activity:
        """Return the counts; see `spikeport.backends.chip.Chip.activity`."""
        return self.log.activity()

    def _totals(self) -> Totals:
        n = self._image.n_cores
        messages = np.zeros((n + 1, n), dtype=np.int64)  # the host, -1, is in the last row
        for wiring, state in self._parts():
            core, _, home = wiring.cost.T
            sent = np.repeat(state.sent[1], np.diff(wiring.fan_start))
            np.add.at(messages, (home, core), sent)
        readout_spikes = int(self.state.spike_count[self._image.readouts].sum())
        return Totals(MessageCounts(messages[:-1], messages[-1]), readout_spikes)

    def _parts(self) -> list[tuple[Wiring, State]]:
        """Return the wiring and state of each thread; without threads, of the whole chip."""
        if self._threads is None:
            return [(self._wiring, self.state)]
        return [(shard.wiring, shard.state) for shard in self._threads.shards]

    @property
    def bytes_per_weight(self) -> int:
        """The size of a weight in the kernels, in bytes."""
        return max(wiring.weights.itemsize for wiring, _ in self._parts())

    def close(self) -> None:
        """Close the log and end the threads; see `spikeport.backends.chip.Chip.close`."""
        self._closed = True
        try:
            self.log.close()
        finally:  # the disk may be full
            if self._threads is not None:
                self._threads.close()


def _learning(image: ChipImage, wiring: Wiring, rng: np.random.RandomState) -> Learning | None:
    """Return the learning of an image; None where nothing learns."""
    return Learning(image, wiring, rng) if image.learns.any() else None
