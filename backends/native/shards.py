"""The cores of a chip, divided among threads: the same bits, in less time where a chip is large.

Only spikes that were sent in the previous step arrive in a step. So each thread adds up the weights
that arrive at its cores and updates these cores; the threads exchange their spikes at the end of
the step. The hand-over between threads takes 60 to 90 us: it pays to divide steps from about 0.3 ms
on.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from spikeport.backends.native.kernel import advance, copy_outputs
from spikeport.backends.native.loaded import Loaded, Neurons, State, neurons_of, resting_state
from spikeport.backends.native.noise import NONE
from spikeport.backends.native.wiring import line_up, wire
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compiled import make_ready


def available() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


def divided(image: ChipImage, n: int) -> list[np.ndarray]:
    """Return the cores of each of at most n threads, with about equal work for each thread.

    Neighbouring cores stay together: they send most spikes to each other.
    """
    core = image.group_core[image.row_group]
    work = np.bincount(core, np.diff(image.rows.start), image.n_cores)
    work += np.bincount(image.compartment_core, minlength=image.n_cores)
    # A core goes to the thread whose share has the middle of its work.
    share = (np.cumsum(work) - work / 2) * n / work.sum()
    cores = [np.flatnonzero(share.astype(int) == i) for i in range(n)]
    return [mine for mine in cores if len(mine)]


class Shard:
    """The cores of one thread: wiring, constants, and their part of the state.

    Parameters
    ----------
    image : ChipImage
        The image.
    cores : ndarray of int
        The thread's cores.
    whole : State
        The state of all cores; the shard shares its arrays of compartments.
    """

    def __init__(self, image: ChipImage, cores: np.ndarray, whole: State) -> None:
        self.wiring = line_up(wire(image, cores))
        self._neurons = neurons_of(image, cores)
        # Sums are not shared: zeros that pad the weights of a run are added to its neighbours.
        own = resting_state(image, self.wiring)
        kept = ("q", "u", "v", "refractory", "spiked", "spike_count")
        shared = {name: getattr(whole, name) for name in kept}
        self._hold_state(own._replace(**shared, held=np.zeros(0, dtype=np.int32)))
        make_ready(advance, self._loaded, 0, NONE, np.zeros((0, 0), dtype=np.int64))

    def _hold_state(self, state: State) -> None:
        self.state = state
        self._loaded = Loaded(self.wiring, self._neurons, state)

    def step(self, n_arriving: int, noise: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Advance by a step; return the spikes."""
        n = advance(self._loaded, n_arriving, noise, counts)
        return self.state.arriving[:n]

    def arrive(self, spikes: np.ndarray) -> None:
        """Take the spikes of all threads and of the host, for the next step."""
        if len(spikes) > len(self.state.arriving):
            # Twice the size needed, so that this happens seldom.
            room = np.zeros(2 * len(spikes), dtype=np.int32)
            self._hold_state(self.state._replace(arriving=room))
        self.state.arriving[: len(spikes)] = spikes


class Threads:
    """The cores of an image that does not learn, on n threads, including the caller's.

    Parameters
    ----------
    image : ChipImage
        The image.
    state : State
        The state of the chip: compartments, and held values.
    neurons : Neurons
        The constants of the chip's compartments.
    n : int
        The largest number of threads; there are never more threads than cores.
    """

    def __init__(self, image: ChipImage, state: State, neurons: Neurons, n: int) -> None:
        self._neurons, self._state = neurons, state
        self.shards = [Shard(image, cores, state) for cores in divided(image, n)]
        self._begin()
        make_ready(copy_outputs, neurons, state)

    def _begin(self) -> None:
        self._process = os.getpid()
        self._pool = ThreadPoolExecutor(max(len(self.shards) - 1, 1), "spikeport")

    def step(
        self, n_arriving: int, sources: np.ndarray, noise: np.ndarray, counts: np.ndarray
    ) -> int:
        """Compute a step, as `kernel.step` does, but the caller has checked the sources."""
        if os.getpid() != self._process:  # a forked process has none of its parent's threads
            self._begin()
        # Threads can share the counts: these are by core, and no core has two threads.
        others = [
            self._pool.submit(shard.step, n_arriving, noise, counts) for shard in self.shards[1:]
        ]
        spikes = [self.shards[0].step(n_arriving, noise, counts)]
        spikes += [other.result() for other in others]
        copy_outputs(self._neurons, self._state)
        # The host's spikes queue behind the chip's own: they arrive in the next step.
        arriving = np.concatenate([*spikes, sources + len(self._state.q)])
        for shard in self.shards:
            shard.arrive(arriving)
        return len(arriving)

    def close(self) -> None:
        """End the threads of this process."""
        if os.getpid() == self._process:
            self._pool.shutdown()
