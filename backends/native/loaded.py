"""The kernels' view of an image: constants and state, loaded once, passed as one object."""

from typing import NamedTuple

import numpy as np
from numba import types
from numba.experimental import structref

from spikeport.backends.native.wiring import LANES, Wiring, aligned_zeros
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compiled import compiled, make_ready

KEYS = ("voltage", "current", "spiked")
STRETCH = 1024
"""Number of compartments updated at once: their state stays in the nearest cache."""


class Neurons(NamedTuple):
    """Constants of neurons: per compartment, unless the field states another shape."""

    block: np.ndarray
    """First compartment of each block, the compartment after its last, its core, and 1 if all its
    compartments have a bias, hence are always active, (n_blocks, 4)."""
    stretch: np.ndarray
    """Stretches of compartments with equal limits: begin, end, vmin, vmax, (.., 4)."""
    bias: np.ndarray
    keep_u: np.ndarray
    keep_v: np.ndarray
    vth: np.ndarray
    refract: np.ndarray
    read: np.ndarray
    """Compartments that outputs read, and the index in `KEYS` of the value to read, (.., 2)."""


class State(NamedTuple):
    """State of the chip: per compartment, unless the field states another shape."""

    sums: np.ndarray
    """Sums of arriving weights, in units of 2^shift: int16 if q has no more bits, else int32."""
    q: np.ndarray
    u: np.ndarray
    v: np.ndarray
    refractory: np.ndarray
    spiked: np.ndarray
    spike_count: np.ndarray
    arriving: np.ndarray
    """Sources of the spikes under way."""
    pending: np.ndarray
    """Sources on the host that spike in this step."""
    spikes_of: np.ndarray
    """Number of spikes of each delivery, (n_deliveries,)."""
    touched: np.ndarray
    """Deliveries that have any spikes."""
    sent: np.ndarray
    """Number of spikes of each fan, in this step and in all steps, (2, n_fans)."""
    held: np.ndarray
    """Values that outputs read after the step."""


@structref.register
class _LoadedType(types.StructRef):
    """The type of `Loaded` for numba."""


class Loaded(structref.StructRefProxy):
    """Wiring, constants and state. numba unpacks this object much faster than single arrays."""

    wiring: Wiring
    neurons: Neurons
    state: State

    def __new__(cls, wiring: Wiring, neurons: Neurons, state: State) -> "Loaded":
        """Return the wiring, constants and state as one object."""
        make_ready(_load, wiring, neurons, state)
        return _load(wiring, neurons, state)


structref.define_proxy(Loaded, _LoadedType, ["wiring", "neurons", "state"])


@compiled
def _load(wiring: Wiring, neurons: Neurons, state: State) -> Loaded:
    result: Loaded = Loaded(wiring, neurons, state)
    return result


@structref.register
class _HostType(types.StructRef):
    """The type of `Host` for numba."""


class Host(structref.StructRefProxy):
    """The memory that a host and a chip share: the host's spikes, and decoded values.

    ``sources`` are the host's, and spike if they are not 0; ``start``, ``index`` and ``weights``
    decode held values into ``inbox``, see `kernel.decode`.
    """

    sources: np.ndarray
    start: np.ndarray
    index: np.ndarray
    weights: np.ndarray
    inbox: np.ndarray

    def __new__(
        cls,
        sources: np.ndarray,
        start: np.ndarray,
        index: np.ndarray,
        weights: np.ndarray,
        inbox: np.ndarray,
    ) -> "Host":
        """Return the arrays as one object."""
        make_ready(_share, sources, start, index, weights, inbox)
        return _share(sources, start, index, weights, inbox)


structref.define_proxy(Host, _HostType, ["sources", "start", "index", "weights", "inbox"])


@compiled
def _share(
    sources: np.ndarray,
    start: np.ndarray,
    index: np.ndarray,
    weights: np.ndarray,
    inbox: np.ndarray,
) -> Host:
    result: Host = Host(sources, start, index, weights, inbox)
    return result


def neurons_of(image: ChipImage, cores: np.ndarray | None = None) -> Neurons:
    """Return the constants of all compartments of an image, and the blocks on some of its cores."""
    mine = np.isin(image.blocks.core, np.arange(image.n_cores) if cores is None else cores)
    starts, biased = image.blocks.start, image.compartments.bias != 0
    always = [biased[part(image.blocks.start, b)].all() for b in range(image.n_blocks)]
    reads = np.diff(image.outputs.start)
    keys = np.repeat([KEYS.index(o.key) for o in image.manifest.outputs], reads)
    return Neurons(
        block=np.stack([starts[:-1], starts[1:], image.blocks.core, always], axis=1)[mine],
        stretch=_stretches(image, mine),
        bias=image.compartments.bias,
        # nengo-loihi decays the current by one 4096th more than set, the voltage as set.
        keep_u=4095 - image.compartments.decay_u,
        keep_v=4096 - image.compartments.decay_v,
        vth=image.compartments.vth,
        refract=image.compartments.refract_delay,
        read=np.stack([image.reads.compartment, keys], axis=1).astype(np.int64),
    )


def _stretches(image: ChipImage, mine: np.ndarray) -> np.ndarray:
    """Return the stretches of the blocks in ``mine``, (n_blocks,) of bool; see `Neurons`."""
    starts, n = image.blocks.start, image.n_compartments
    limits = np.stack([image.blocks.vmin, image.blocks.vmax], axis=1)
    changes = np.append(True, (np.diff(limits, axis=0) != 0).any(axis=1) | np.diff(mine))
    # A stretch has one vmin and vmax, which the kernel then holds in registers.
    begin = np.union1d(starts[:-1][changes], np.arange(0, n, STRETCH))
    block = np.searchsorted(starts, begin, side="right") - 1
    stretches = np.column_stack([begin, np.append(begin[1:], n), limits[block]])
    result: np.ndarray = stretches[mine[block]]
    return result


def resting_state(image: ChipImage, wiring: Wiring) -> State:
    """Return the state at rest: zero throughout."""
    n, n_deliveries = image.n_compartments, len(wiring.run_start) - 1
    q, u, v, refractory, spiked, spike_count = np.zeros((6, n), dtype=np.int32)
    return State(
        # The room takes the zeros that pad runs: these are added behind the last sum, too.
        sums=aligned_zeros(n, wiring.sums_type, room=2 * LANES),
        q=q,
        u=u,
        v=v,
        refractory=refractory,
        spiked=spiked,
        spike_count=spike_count,
        arriving=np.zeros(len(wiring.fan), dtype=np.int32),
        pending=np.zeros(len(wiring.fan) - n, dtype=np.int32),
        spikes_of=np.zeros(n_deliveries, dtype=np.int32),
        touched=np.zeros(n_deliveries + 1, dtype=np.int32),  # the last entry written may not count
        sent=np.zeros((2, len(wiring.fan_start) - 1), dtype=np.int64),
        held=np.zeros(len(image.reads.compartment), dtype=np.int32),
    )
