"""One compiled step of the chip, equal to nengo-loihi's emulator in every bit of the state.

A compartment sums the weights of its arriving spikes in q, and has a current u and a voltage v:

    q  = 2^shift (sum of delivered weights) (+ noise), wrapped to 22 bits
    u <- decay(u, 4095 - decay_u) + q, wrapped to 24 bits
    v <- decay(v, 4096 - decay_v) + wrap24(u + bias (+ noise))
    v <- clip(v, vmin, vmax), 0 while refractory;  spike where v > vth, then v = 0
    decay(x, r) = sign(x) ((|x| r) >> 12)

A spike is under way until it arrives, in the step after it was sent.

Weights and their sums are stored in units of 2^shift, the largest in which all weights are whole.
Only the lowest 22 - shift bits of a sum reach q. Weights that nengo-loihi discretised have a shift
of 6 or more, so that sums of 16 bits are enough: they may overflow on the way, in any order,
without a loss, and half as many bytes are added as with 32 bits.

Integers are 32 bits wide and wrap; every intermediate is cast, since numba widens int32 sums to
int64. Each loop goes over at most 1,024 compartments and few arrays, so that LLVM turns it into
vector instructions. An intrinsic adds weights in vectors of 32, with the vector instructions that
the machine has.

Compiled functions that call each other are all in one file: numba's cache on disk would not notice
changes of functions in other files.

Source: nengo-loihi 1.1.0, emulator/interface.py and builder/discretize.py.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from spikeport.backends.native.loaded import Host, Loaded, Neurons, State
from spikeport.backends.native.wiring import LANES, Wiring
from spikeport.compile.image.manifest import STATE_BITS, SUM_BITS
from spikeport.compiled import compiled, inlined, without_gil

Q_SIZE, U_SIZE = SUM_BITS, STATE_BITS
"""Bits of q, and of u."""
I32 = np.int32
SPIKES, OPERATIONS, ACTIVE, INACTIVE, MESSAGES_IN, LEARNING = range(6)
"""Rows of the counts of a step, in the order of `activity.PER_STEP`."""


@compiled
def step(
    loaded: Loaded, n_arriving: int, sources: np.ndarray, noise: np.ndarray, counts: np.ndarray
) -> int:
    """Compute a whole step of a chip that does not learn; return the number of spikes under way.

    This is `accept`, `deliver` and `update` in one call; it returns -1 if `accept` does.
    """
    n_pending = accept(loaded, sources)
    if n_pending < 0:
        return -1
    deliver(loaded, n_arriving, counts)
    return update(loaded, n_pending, noise, counts)


@without_gil
def advance(loaded: Loaded, n_arriving: int, noise: np.ndarray, counts: np.ndarray) -> int:
    """Compute a step of some cores of a chip, on a thread; return the number of their spikes.

    `spikeport.backends.native.shards` adds the spikes of the other cores and of the host.
    """
    deliver(loaded, n_arriving, counts)
    return update(loaded, 0, noise, counts)


@compiled
def exchange(
    loaded: Loaded, n_arriving: int, host: Host, noise: np.ndarray, counts: np.ndarray
) -> tuple[int, int, bool]:
    """Compute a step with the host's spikes, and decode the outputs for the host.

    Returns
    -------
    n_arriving : int
        Spikes under way.
    n_sent : int
        Spikes of the host.
    decoded : bool
        True if the values of all outputs are in the host's inbox, see `decode`.
    """
    n_sent, first = 0, len(loaded.state.q)
    for i in range(len(host.sources)):
        # Without a branch: write every source, and let the next overwrite one that does not spike.
        loaded.state.pending[n_sent] = first + i
        n_sent += host.sources[i] != 0
    deliver(loaded, n_arriving, counts)
    n_arriving = update(loaded, n_sent, noise, counts)
    decoded = decode(loaded.state.held, host.start, host.index, host.weights, host.inbox)
    return n_arriving, n_sent, decoded


@compiled
def decode(
    held: np.ndarray,
    start: np.ndarray,
    index: np.ndarray,
    weights: np.ndarray,
    values: np.ndarray,
) -> bool:
    """Sum weighted states: ``values[i]`` is the sum over entries ``start[i] : start[i + 1]``.

    Return True if each value is there, and its sum has at most one nonzero term. Sums of more terms
    are rounded differently in NumPy's product, which adds them in another order.
    """
    # A decoder whose sums have too many terms has an empty table: no start for each value.
    exact = len(start) == len(values) + 1
    for i in range(len(start) - 1):
        total, terms = 0.0, 0
        for k in range(start[i], start[i + 1]):
            if held[index[k]] != 0:
                total += held[index[k]] * weights[k]
                terms += 1
        values[i] = total
        exact &= terms <= 1
    return exact


@compiled
def accept(loaded: Loaded, sources: np.ndarray) -> int:
    """Put the host's spikes into ``pending``; return their number, or -1 if a source is unknown.

    The caller has made room for them.
    """
    first, pending = len(loaded.state.q), loaded.state.pending
    size = len(loaded.wiring.fan) - first
    for n in range(len(sources)):
        if sources[n] < 0 or sources[n] >= size:
            return -1
        pending[n] = first + sources[n]
    return len(sources)


@compiled
def deliver(loaded: Loaded, n_arriving: int, counts: np.ndarray) -> int:
    """Add up the weights of all arriving spikes; return the number of deliveries touched.

    The synaptic operations and messages of each core are added to ``counts``.
    """
    wiring, state = loaded.wiring, loaded.state
    n = _count_arrivals(wiring, state, n_arriving)
    for i in range(n):
        number = state.touched[i]
        times = state.spikes_of[number]
        # Cleared here, so that the next step finds zeros without another loop.
        state.spikes_of[number] = 0
        ahead = _first_weight(wiring, state.touched[i + 1]) if i + 1 < n else 0
        for r in range(wiring.run_start[number], wiring.run_start[number + 1]):
            first, weight, length, shift = wiring.run[r]
            _add(state.sums, first, wiring.weights, weight, length, times << shift, ahead)
            ahead += length
        _add_scattered(wiring, state.sums, number, times)
    _count(wiring, state.sent, counts)
    return n


@compiled
def _count_arrivals(wiring: Wiring, state: State, n_arriving: int) -> int:
    """Count the arriving spikes by delivery and by fan; return the number of deliveries.

    There are no branches on spikes, which would be mispredicted.
    """
    n = 0
    for source in state.arriving[:n_arriving]:
        # Costs are counted by fan: there are far fewer fans than sources.
        state.sent[0, wiring.fan[source]] += 1
        for k in range(wiring.delivery_start[source], wiring.delivery_start[source + 1]):
            number = np.uintp(wiring.delivery[k])
            before = state.spikes_of[number]
            # The first spike of a delivery lists it; after any other, the next one overwrites it.
            state.touched[np.uintp(n)] = number
            n += before == 0
            state.spikes_of[number] = before + 1
    return n


@inlined
def _first_weight(wiring: Wiring, number: int) -> int:
    """Return where the weights of a delivery begin, to prefetch them; 0 behind the last run."""
    r = wiring.run_start[number]
    return wiring.run[r, 1] if r < len(wiring.run) else 0


@inlined
def _add(
    sums: np.ndarray,
    first: int,
    weights: np.ndarray,
    begin: int,
    n: int,
    times: int,
    ahead: int,
) -> None:
    """Add the weights of a run, and prefetch as many from ``ahead`` on, which are added next."""
    # Unsigned indices: numba then needs no check for negative ones.
    at, start, coming = np.uintp(first), np.uintp(begin), np.uintp(ahead)
    factor, lanes = sums.dtype.type(times), np.uintp(LANES)
    for _ in range(np.uintp(n) // lanes):
        _fetch(weights, coming)  # type: ignore[call-arg]
        _add_lanes(sums, at, weights, start, factor)
        at, start, coming = at + lanes, start + lanes, coming + lanes
    # Runs that are lined up leave no remainder.
    for j in range(np.uintp(n) % lanes):
        sums[at + j] += sums.dtype.type(factor * weights[start + j])


@intrinsic
def _add_lanes(
    _typing: Any, sums: Any, at: Any, weights: Any, start: Any, factor: Any
) -> tuple[Any, Callable[..., Any]]:
    """Add `LANES` weights: ``sums[at + j] += factor * weights[start + j]``, j < `LANES`.

    LLVM vectorises a loop only with checks of its arrays, which take longer than most runs.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        to, of = (
            _vector_at(context, builder, signature.args[i], *values[i : i + 2]) for i in (0, 2)
        )
        total, weight = builder.load(to, align=1), builder.load(of, align=1)
        lanes, one = total.type, ir.IntType(32)
        if weight.type.element.width < lanes.element.width:
            weight = builder.sext(weight, lanes)
        elif weight.type.element.width > lanes.element.width:
            weight = builder.trunc(weight, lanes)
        nothing = ir.Constant(lanes, ir.Undefined)
        first = builder.insert_element(nothing, values[4], one(0))
        factors = builder.shuffle_vector(first, nothing, ir.VectorType(one, LANES)(None))
        builder.store(builder.add(total, builder.mul(weight, factors)), to, align=1)
        return context.get_dummy_value()

    return types.void(sums, at, weights, start, factor), generate


@intrinsic
def _fetch(_typing: Any, weights: Any, start: Any) -> tuple[Any, Callable[..., Any]]:
    """Begin to load weights into the nearest cache; ``start`` may lie behind the last weight."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = builder.bitcast(
            _vector_at(context, builder, signature.args[0], *values), ir.IntType(8).as_pointer()
        )
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [place.type, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch", [place.type], kind)
        # LLVM's codes: for reading, keep in all caches, data.
        builder.call(fetch, [place, number(0), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(weights, start), generate


def _vector_at(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    """Return LLVM's pointer to a vector of `LANES` elements of an array."""
    begin = context.make_array(kind)(context, builder, array).data
    place = builder.gep(begin, [index])
    return builder.bitcast(place, ir.VectorType(begin.type.pointee, LANES).as_pointer())


@inlined
def _add_scattered(wiring: Wiring, sums: np.ndarray, number: int, times: int) -> None:
    factor = sums.dtype.type(times)
    begin, end = wiring.scattered_start[number], wiring.scattered_start[number + 1]
    for j in range(np.uintp(begin), np.uintp(end)):
        sums[np.uintp(wiring.target[j])] += sums.dtype.type(factor * wiring.value[j])


@compiled
def _count(wiring: Wiring, sent: np.ndarray, counts: np.ndarray) -> None:
    for fan in range(sent.shape[1]):
        n = sent[0, fan]
        if n:
            sent[0, fan] = 0
            sent[1, fan] += n
            for k in range(np.uintp(wiring.fan_start[fan]), np.uintp(wiring.fan_start[fan + 1])):
                core = np.uintp(wiring.cost[k, 0])
                counts[MESSAGES_IN, core] += n
                counts[OPERATIONS, core] += n * wiring.cost[k, 1]


@compiled
def update(loaded: Loaded, n_pending: int, noise: np.ndarray, counts: np.ndarray) -> int:
    """Update all compartments, and fill ``held``; return the number of spikes under way.

    ``noise`` (2, n_compartments) is added to q and to u; it has no columns if there is no noise.
    The spikes, active and inactive updates of each core are added to ``counts``.
    """
    neurons, state, shift = loaded.neurons, loaded.state, loaded.wiring.shift
    # One loop for each quantity, not one for all: each has few arrays, so LLVM vectorises it.
    for a, b, vmin, vmax in neurons.stretch:
        v, refractory, spiked = state.v[a:b], state.refractory[a:b], state.spiked[a:b]
        _receive(state.q[a:b], state.sums[a:b], shift, noise[0, a:b])
        _integrate(state.q[a:b], state.u[a:b], neurons.keep_u[a:b])
        _leak(v, state.u[a:b], neurons.bias[a:b], neurons.keep_v[a:b], noise[1, a:b])
        _fire(v, refractory, neurons.vth[a:b], spiked, I32(vmin), I32(vmax))
        _rest(refractory, neurons.refract[a:b], spiked)
    copy_outputs(neurons, state)
    n = _list_spikes(neurons, state, counts)
    # The host's spikes queue behind the chip's own: they arrive in the next step.
    for i in range(n_pending):
        state.arriving[n + i] = state.pending[i]
    return n + n_pending


@inlined
def _wrap(x: np.int32, size: int) -> np.int32:
    shift = 32 - size
    # The shift to the right is arithmetic: it repeats the sign bit of the narrower number.
    return I32(I32(x << shift) >> shift)


@inlined
def _decay(x: np.int32, keep: np.int32) -> np.int32:
    # |x| keep >> 12 without 64 bits: the high part of |x| times keep needs no rounding.
    sign = I32(x >> 31)
    size = I32(I32(x ^ sign) - sign)
    low = I32(I32(I32(size & 4095) * keep) >> 12)
    kept = I32(I32(I32(size >> 12) * keep) + low)
    return I32(I32(kept ^ sign) - sign)


@compiled
def _receive(q: np.ndarray, sums: np.ndarray, shift: int, noise: np.ndarray) -> None:
    """Set q to the sums of the weights that arrived, plus noise, and clear the sums."""
    for i in range(len(q)):
        q[i] = I32(I32(sums[i]) << shift)
        sums[i] = 0
    # Without noise the array has no columns, and this loop does nothing.
    for i in range(len(noise)):
        q[i] = I32(q[i] + noise[i])


@compiled
def _integrate(q: np.ndarray, u: np.ndarray, keep_u: np.ndarray) -> None:
    for i in range(len(q)):
        q[i] = _wrap(q[i], Q_SIZE)
        u[i] = _wrap(I32(_decay(u[i], keep_u[i]) + q[i]), U_SIZE)


@compiled
def _leak(
    v: np.ndarray, u: np.ndarray, bias: np.ndarray, keep_v: np.ndarray, noise: np.ndarray
) -> None:
    if len(noise):
        for i in range(len(v)):
            total = _wrap(I32(I32(u[i] + bias[i]) + noise[i]), U_SIZE)
            v[i] = I32(_decay(v[i], keep_v[i]) + total)
    else:
        for i in range(len(v)):
            total = _wrap(I32(u[i] + bias[i]), U_SIZE)
            v[i] = I32(_decay(v[i], keep_v[i]) + total)


@compiled
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
        # The voltage is held at zero while a compartment rests; its current goes on.
        x = I32(0) if refractory[i] > 0 else x
        fires = x > vth[i]
        spiked[i] = I32(fires)
        v[i] = I32(0) if fires else x


@compiled
def _rest(refractory: np.ndarray, refract: np.ndarray, spiked: np.ndarray) -> None:
    # With masks instead of branches, which LLVM would not turn into vector instructions here.
    for i in range(len(refractory)):
        mask = I32(-spiked[i])
        left = I32(I32(refract[i] & mask) | I32(refractory[i] & ~mask))
        left = I32(left - I32(1))
        # The mask of the sign is all ones if ``left`` is negative, so this is max(left, 0).
        refractory[i] = I32(left & ~I32(left >> 31))


@compiled
def copy_outputs(neurons: Neurons, state: State) -> None:
    """Copy the values that outputs read: the voltage, current or spike of each compartment."""
    for k in range(len(state.held)):
        i, key = neurons.read[k]
        state.held[k] = state.v[i] if key == 0 else state.u[i] if key == 1 else state.spiked[i]


@compiled
def _list_spikes(neurons: Neurons, state: State, counts: np.ndarray) -> int:
    """List the compartments that spiked, without branches on spikes: they would be mispredicted."""
    n = 0
    for block in range(len(neurons.block)):
        begin, end, core, always_active = neurons.block[block]
        before = n
        for i in range(np.uintp(begin), np.uintp(end)):
            # As in `_count_arrivals`: always written, and overwritten unless it spiked.
            state.arriving[np.uintp(n)] = i
            n += state.spiked[i]
        # If all compartments have a bias, each is active in every step: there is no need to count.
        active = end - begin if always_active else _count_active(neurons, state, begin, end)
        counts[SPIKES, core] += n - before
        counts[ACTIVE, core] += active
        counts[INACTIVE, core] += end - begin - active
    for i in state.arriving[:n]:
        state.spike_count[i] += 1
    return n


@compiled
def _count_active(neurons: Neurons, state: State, begin: int, end: int) -> int:
    active = 0
    for i in range(np.uintp(begin), np.uintp(end)):
        moving = state.q[i] | state.u[i] | state.v[i] | state.spiked[i] | neurons.bias[i]
        active += moving != 0
    return active
