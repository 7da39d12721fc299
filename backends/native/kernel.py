"""One step of the chip, compiled. Equal to nengo-loihi's emulator in every bit of its state.

Integers are 32 bits wide and wrap; every intermediate is cast, since numba widens int32 sums to
int64. Loops go over blocks of at most 1,024 compartments and few arrays each: that is what LLVM
turns into vector instructions.

    q  = sum of delivered weights (+ noise), wrapped to 22 bits
    u <- decay(u, 4095 - decay_u) + q, wrapped to 24 bits
    v <- decay(v, 4096 - decay_v) + wrap24(u + bias (+ noise))
    v <- clip(v, vmin, vmax), 0 while refractory;  spike where v > vth, then v = 0
    decay(x, r) = sign(x) ((|x| r) >> 12)

Source: nengo-loihi 1.1.0, emulator/interface.py and builder/discretize.py.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from spikeport.backends.native.wiring import Wiring

Q_BITS = 21
U_BITS = 23
I32 = np.int32
SPIKES, OPERATIONS, ACTIVE, INACTIVE, MESSAGES_IN, LEARNING = range(6)
"""Rows of the counts of a step, in the order of `activity.PER_STEP`."""
KEYS = ("voltage", "current", "spiked")


class Neurons(NamedTuple):
    """Constants of compartments.

    ``block_start`` to ``vmax`` and ``always_active`` (all compartments have a bias) are of blocks;
    ``readout`` lists compartments that must not spike; ``read`` and ``read_key`` list what outputs
    read, as places in `KEYS`; the rest is per compartment.
    """

    block_start: np.ndarray
    block_core: np.ndarray
    vmin: np.ndarray
    vmax: np.ndarray
    bias: np.ndarray
    keep_u: np.ndarray
    keep_v: np.ndarray
    vth: np.ndarray
    refract: np.ndarray
    core: np.ndarray
    always_active: np.ndarray
    readout: np.ndarray
    read: np.ndarray
    read_key: np.ndarray


class State(NamedTuple):
    """What changes.

    ``arriving`` lists the sources of spikes under way, ``spikes_of`` counts them by delivery,
    ``touched`` lists those deliveries, ``delivered`` counts by source over the run; the rest is per
    compartment.
    """

    q: np.ndarray
    u: np.ndarray
    v: np.ndarray
    refractory: np.ndarray
    spiked: np.ndarray
    spike_count: np.ndarray
    arriving: np.ndarray
    spikes_of: np.ndarray
    touched: np.ndarray
    delivered: np.ndarray
    readout_spikes: np.ndarray


@njit(cache=True)
def accept(sources: np.ndarray, first: int, size: int, pending: np.ndarray, n: int) -> int:
    """Append the spikes of an input to ``pending``, which holds n; returns -1 if one is not its."""
    if len(sources) > size:
        return -1
    for source in sources:
        if source < 0 or source >= size:
            return -1
        pending[n] = first + source
        n += 1
    return n


@njit(cache=True)
def deliver(wiring: Wiring, state: State, n_arriving: int, counts: np.ndarray) -> int:
    """Set q to the weights of all arriving spikes; returns the number of deliveries touched.

    ``counts`` gains synaptic operations and messages of each core in its rows for them.
    """
    state.q[:] = 0
    n = 0
    for i in range(n_arriving):
        source = state.arriving[i]
        state.delivered[source] += 1
        for k in range(wiring.reached_start[source], wiring.reached_start[source + 1]):
            counts[MESSAGES_IN, wiring.reached_core[k]] += 1
        for k in range(wiring.delivery_start[source], wiring.delivery_start[source + 1]):
            number = wiring.delivery[k]
            if state.spikes_of[number] == 0:
                state.touched[n] = number
                n += 1
            state.spikes_of[number] += 1
    for i in range(n):
        number = state.touched[i]
        times = state.spikes_of[number]
        state.spikes_of[number] = 0
        first, run_begin, run_end, core, length = wiring.place[number]
        counts[OPERATIONS, core] += times * length
        for r in range(run_begin, run_end):
            begin, weight, length = wiring.run[r]
            _add(state.q, np.uintp(first + begin), wiring.weights, np.uintp(weight), length, times)
    return n


@njit(cache=True, inline="always")
def _add(
    q: np.ndarray, at: np.uintp, weights: np.ndarray, begin: np.uintp, n: np.int32, times: np.int32
) -> None:
    # Unsigned indices: numba then needs no check for negative ones, and LLVM makes vectors.
    if times == 1:
        for j in range(np.uintp(n)):
            q[at + j] = I32(q[at + j] + I32(weights[begin + j]))
    else:
        for j in range(np.uintp(n)):
            q[at + j] = I32(q[at + j] + I32(I32(times) * I32(weights[begin + j])))


@njit(cache=True, inline="always")
def _wrap(x: np.int32, bits: int) -> np.int32:
    shift = 31 - bits
    return I32(I32(x << shift) >> shift)


@njit(cache=True, inline="always")
def _decay(x: np.int32, keep: np.int32) -> np.int32:
    # |x| keep >> 12 without 64 bits: the high part of |x| times keep needs no rounding.
    sign = I32(x >> 31)
    size = I32(I32(x ^ sign) - sign)
    low = I32(I32(I32(size & 4095) * keep) >> 12)
    kept = I32(I32(I32(size >> 12) * keep) + low)
    return I32(I32(kept ^ sign) - sign)


@njit(cache=True)
def _integrate(q: np.ndarray, u: np.ndarray, keep_u: np.ndarray) -> None:
    for i in range(len(q)):
        q[i] = _wrap(q[i], Q_BITS)
        u[i] = _wrap(I32(_decay(u[i], keep_u[i]) + q[i]), U_BITS)


@njit(cache=True)
def _leak(
    v: np.ndarray, u: np.ndarray, bias: np.ndarray, keep_v: np.ndarray, noise: np.ndarray
) -> None:
    if len(noise):
        for i in range(len(v)):
            total = _wrap(I32(I32(u[i] + bias[i]) + noise[i]), U_BITS)
            v[i] = I32(_decay(v[i], keep_v[i]) + total)
    else:
        for i in range(len(v)):
            total = _wrap(I32(u[i] + bias[i]), U_BITS)
            v[i] = I32(_decay(v[i], keep_v[i]) + total)


@njit(cache=True)
def _fire(
    v: np.ndarray,
    refractory: np.ndarray,
    vth: np.ndarray,
    spiked: np.ndarray,
    vmin: np.int32,
    vmax: np.int32,
) -> None:
    for i in range(len(v)):
        x = min(max(v[i], vmin), vmax)
        x = I32(0) if refractory[i] > 0 else x
        fires = x > vth[i]
        spiked[i] = I32(fires)
        v[i] = I32(0) if fires else x


@njit(cache=True)
def _rest(refractory: np.ndarray, refract: np.ndarray, spiked: np.ndarray) -> None:
    # With masks instead of branches, which LLVM would not turn into vector instructions here.
    for i in range(len(refractory)):
        mask = I32(-spiked[i])
        left = I32(I32(refract[i] & mask) | I32(refractory[i] & ~mask))
        left = I32(left - I32(1))
        refractory[i] = I32(left & ~I32(left >> 31))


@njit(cache=True)
def _list_spikes(neurons: Neurons, state: State, counts: np.ndarray) -> int:
    """List the compartments that spiked; without branches, which spikes would make mispredicted."""
    n = 0
    for i in range(len(state.spiked)):
        state.arriving[n] = i
        n += state.spiked[i]
    for i in state.arriving[:n]:
        state.spike_count[i] += 1
        counts[SPIKES, neurons.core[i]] += 1
    for i in neurons.readout:
        state.readout_spikes[0] += state.spiked[i]
    return n


@njit(cache=True)
def _count_active(neurons: Neurons, state: State, block: int) -> int:
    active = 0
    for i in range(neurons.block_start[block], neurons.block_start[block + 1]):
        moving = state.q[i] != 0 or state.u[i] != 0 or state.v[i] != 0
        active += neurons.bias[i] != 0 or moving or state.spiked[i] != 0
    return active


@njit(cache=True)
def update(neurons: Neurons, state: State, noise: np.ndarray, counts: np.ndarray) -> int:
    """Update all compartments from q; returns the number of spikes, listed in ``arriving``.

    ``noise`` (2, n_compartments) is added to q and to u, and has no columns where there is none.
    ``counts`` gains spikes, active and inactive updates of each core in its rows for them.
    """
    for i in range(noise.shape[1]):
        state.q[i] = I32(state.q[i] + noise[0, i])
    for block in range(len(neurons.block_core)):
        a, b = neurons.block_start[block], neurons.block_start[block + 1]
        v, refractory, spiked = state.v[a:b], state.refractory[a:b], state.spiked[a:b]
        _integrate(state.q[a:b], state.u[a:b], neurons.keep_u[a:b])
        _leak(v, state.u[a:b], neurons.bias[a:b], neurons.keep_v[a:b], noise[1, a:b])
        _fire(v, refractory, neurons.vth[a:b], spiked, neurons.vmin[block], neurons.vmax[block])
        _rest(refractory, neurons.refract[a:b], spiked)
        active = b - a
        if not neurons.always_active[block]:
            active = _count_active(neurons, state, block)
        counts[ACTIVE, neurons.block_core[block]] += active
        counts[INACTIVE, neurons.block_core[block]] += b - a - active
    return _list_spikes(neurons, state, counts)


@njit(cache=True)
def gather(neurons: Neurons, state: State, held: np.ndarray) -> None:
    """Copy what outputs read into ``held``: the voltage, current or spike of each compartment."""
    for k in range(len(held)):
        i = neurons.read[k]
        what = neurons.read_key[k]
        held[k] = state.v[i] if what == 0 else state.u[i] if what == 1 else state.spiked[i]


@njit(cache=True)
def step(
    wiring: Wiring,
    neurons: Neurons,
    state: State,
    n_arriving: int,
    noise: np.ndarray,
    counts: np.ndarray,
    held: np.ndarray,
) -> int:
    """A whole step of a chip that does not learn; returns the number of spikes.

    The same as `deliver`, `update` and `gather` in turn, in one call.
    """
    deliver(wiring, state, n_arriving, counts)
    n = update(neurons, state, noise, counts)
    gather(neurons, state, held)
    return n
