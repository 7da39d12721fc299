"""What the kernels work on: an image's constants and state, loaded once, passed as one object."""

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.experimental import structref

from spikeport.backends.native.wiring import Wiring
from spikeport.compile.image import ChipImage

KEYS = ("voltage", "current", "spiked")
NARROW_SHIFT = 6
"""From so many bits on, sums need no more than 16 of the 22 bits of q."""
CACHE_LINE = 64
"""Its bytes."""
STRETCH = 1024
"""Compartments updated at once: few enough that their state stays in the nearest cache."""


class Neurons(NamedTuple):
    """Constants of compartments: per compartment, unless said otherwise."""

    block: np.ndarray
    """(n_blocks, 4) of each block: its first compartment and the one after its last, its core, and
    1 if all of them have a bias, hence are always active."""
    stretch: np.ndarray
    """(.., 4) of each stretch of compartments clipped alike: begin, end, vmin, vmax."""
    bias: np.ndarray
    keep_u: np.ndarray
    keep_v: np.ndarray
    vth: np.ndarray
    refract: np.ndarray
    read: np.ndarray
    """(.., 2) what outputs read: compartments, and places in `KEYS`."""


class State(NamedTuple):
    """What changes: per compartment, unless said otherwise."""

    sums: np.ndarray
    """Weights that arrive, in units of 2^shift: int16 where q has no more bits, else int32."""
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
    """(n_deliveries,) spikes of each delivery."""
    touched: np.ndarray
    """Deliveries that have any."""
    sent: np.ndarray
    """(2, n_fans) spikes of each fan: in this step, and in all steps."""
    held: np.ndarray
    """What outputs read after the step."""


@structref.register
class _LoadedType(types.StructRef):
    """How numba sees `Loaded`."""


class Loaded(structref.StructRefProxy):
    """Wiring, constants and state. numba unpacks this much faster than their arrays, one by one."""

    wiring: Wiring
    neurons: Neurons
    state: State

    def __new__(cls, wiring: Wiring, neurons: Neurons, state: State) -> Any:
        """Load them."""
        return _load(wiring, neurons, state)


structref.define_proxy(Loaded, _LoadedType, ["wiring", "neurons", "state"])


@njit(cache=True)
def _load(wiring: Wiring, neurons: Neurons, state: State) -> Loaded:
    return Loaded(wiring, neurons, state)


def neurons_of(image: ChipImage) -> Neurons:
    """The constants of an image's compartments."""
    starts, biased = image["block_start"], image["bias"] != 0
    always = [biased[image.part("block_start", b)].all() for b in range(image.n_blocks)]
    reads = np.diff(image["output_start"])
    keys = np.repeat([KEYS.index(o["key"]) for o in image.manifest["outputs"]], reads)
    return Neurons(
        block=np.stack([starts[:-1], starts[1:], image["block_core"], always], axis=1),
        stretch=_stretches(image),
        bias=image["bias"],
        keep_u=4095 - image["decay_u"],
        keep_v=4096 - image["decay_v"],
        vth=image["vth"],
        refract=image["refract_delay"],
        read=np.stack([image["output_compartment"], keys], axis=1).astype(np.int64),
    )


def _stretches(image: ChipImage) -> np.ndarray:
    """Compartments cut where another voltage range begins, and every `STRETCH` of them."""
    starts, n = image["block_start"], image.n_compartments
    limits = np.stack([image["block_vmin"], image["block_vmax"]], axis=1)
    changes = np.append(True, (np.diff(limits, axis=0) != 0).any(axis=1))
    begin = np.union1d(starts[:-1][changes], np.arange(0, n, STRETCH))
    block = np.searchsorted(starts, begin, side="right") - 1
    return np.column_stack([begin, np.append(begin[1:], n), limits[block]])


def _aligned_sums(wiring: Wiring, n: int, dtype: type) -> np.ndarray:
    """(n,) zeros; where most weights are added a cache line begins, so that vectors share none."""
    added = np.bincount(wiring.run[:, 0], weights=wiring.run[:, 2], minlength=1)
    line = CACHE_LINE // np.dtype(dtype).itemsize
    room: np.ndarray = np.zeros(n + line, dtype=dtype)
    skipped = -(room.ctypes.data // room.itemsize + int(added.argmax())) % line
    return room[skipped : skipped + n]


def resting_state(image: ChipImage, wiring: Wiring) -> State:
    """All state at zero."""
    n, n_deliveries = image.n_compartments, len(wiring.run_start) - 1
    q, u, v, refractory, spiked, spike_count = np.zeros((6, n), dtype=np.int32)
    narrow = wiring.shift >= NARROW_SHIFT
    return State(
        sums=_aligned_sums(wiring, n, np.int16 if narrow else np.int32),
        q=q,
        u=u,
        v=v,
        refractory=refractory,
        spiked=spiked,
        spike_count=spike_count,
        arriving=np.zeros(len(wiring.fan), dtype=np.int32),
        pending=np.zeros(len(wiring.fan) - n, dtype=np.int32),
        spikes_of=np.zeros(n_deliveries, dtype=np.int32),
        touched=np.zeros(n_deliveries + 1, dtype=np.int32),  # one more is written than counts
        sent=np.zeros((2, len(wiring.fan_start) - 1), dtype=np.int64),
        held=np.zeros(len(image["output_compartment"]), dtype=np.int32),
    )
