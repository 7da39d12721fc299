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


class Neurons(NamedTuple):
    """Constants of compartments; per compartment, but for those of blocks."""

    block_start: np.ndarray
    block_core: np.ndarray
    vmin: np.ndarray
    vmax: np.ndarray
    bias: np.ndarray
    keep_u: np.ndarray
    keep_v: np.ndarray
    vth: np.ndarray
    refract: np.ndarray
    always_active: np.ndarray
    readout: np.ndarray


class State(NamedTuple):
    """What changes: per compartment, but for ``arriving`` (the spikes under way) and tallies."""

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
        row = wiring.row[number]
        counts[OPERATIONS, wiring.core[number]] += times * wiring.row_length[row]
        for run in range(wiring.run_start[row], wiring.run_start[row + 1]):
            begin = wiring.first[number] + wiring.run_target[run]
            length = wiring.run_length[run]
            target = state.q[begin : begin + length]
            begin = wiring.run_weight[run]
            weights = wiring.weights[begin : begin + length]
            if times == 1:
                for j in range(length):
                    target[j] = I32(target[j] + I32(weights[j]))
            else:
                for j in range(length):
                    target[j] = I32(target[j] + I32(I32(times) * I32(weights[j])))
    return n


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
        spiked[i] = fires
        v[i] = I32(0) if fires else x


@njit(cache=True)
def _rest(refractory: np.ndarray, refract: np.ndarray, spiked: np.ndarray) -> None:
    for i in range(len(refractory)):
        left = refract[i] if spiked[i] else refractory[i]
        refractory[i] = max(I32(left - 1), I32(0))


@njit(cache=True)
def _is_active(state: State, i: int) -> bool:
    return state.spiked[i] or state.q[i] != 0 or state.u[i] != 0 or state.v[i] != 0


@njit(cache=True)
def update(neurons: Neurons, state: State, noise: np.ndarray, counts: np.ndarray) -> int:
    """Update all compartments from q; returns the number of spikes, listed in ``arriving``.

    ``noise`` (2, n_compartments) is added to q and to u, and has no columns where there is none.
    ``counts`` gains spikes, active and inactive updates of each core in its rows for them.
    """
    n = 0
    for i in range(noise.shape[1]):
        state.q[i] = I32(state.q[i] + noise[0, i])
    for block in range(len(neurons.block_core)):
        a, b = neurons.block_start[block], neurons.block_start[block + 1]
        _integrate(state.q[a:b], state.u[a:b], neurons.keep_u[a:b])
        v, refractory, spiked = state.v[a:b], state.refractory[a:b], state.spiked[a:b]
        _leak(v, state.u[a:b], neurons.bias[a:b], neurons.keep_v[a:b], noise[1, a:b])
        _fire(v, refractory, neurons.vth[a:b], spiked, neurons.vmin[block], neurons.vmax[block])
        _rest(refractory, neurons.refract[a:b], spiked)
        core = neurons.block_core[block]
        before = n
        for i in range(a, b):
            if state.spiked[i]:
                state.arriving[n] = i
                state.spike_count[i] += 1
                n += 1
        counts[SPIKES, core] += n - before
        active = b - a
        if not neurons.always_active[block]:
            active = 0
            for i in range(a, b):
                active += neurons.bias[i] != 0 or _is_active(state, i)
        counts[ACTIVE, core] += active
        counts[INACTIVE, core] += b - a - active
    for i in neurons.readout:
        state.readout_spikes[0] += state.spiked[i]
    return n
