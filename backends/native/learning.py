"""PES learning as nengo-loihi's emulator computes it, its stream of random numbers included.

Every ``train_epoch`` and ``learn_epoch`` steps:

    trace  <- round(trace exp(-train_epoch / tau) + magnitude where a spike arrived), 127 at most
    weight <- round(weight + rate trace error), in units that the chip can hold

Both are rounded away from zero with the probability of their fraction. Errors are integers from
-127 to 127.

Source: nengo-loihi 1.1.0, emulator/interface.py (SynapseState) and builder/discretize.py.
"""

import itertools
import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from spikeport.backends.native.contacts import first_contacts
from spikeport.backends.native.rows import kept_synapses
from spikeport.backends.native.wiring import Wiring
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compile.image.validation import WEIGHT_BITS_OF_CODE
from spikeport.compiled import compiled, inlined, make_ready

LEARN_FRAC, OVERFLOW_BITS = 7, 2
"""Fractional bits of a weight while it learns, and bits by which a product overflows."""
LEAST_EXPONENT = 6
"""Exponent of weights whose ``weight_exp`` is 0."""
LARGEST_ERROR = MOST_TRACE = 127
"""Largest sizes of an error and of a trace, of 7 bits each."""
I32 = np.int32


class Rule(NamedTuple):
    """Constants by which the weights of a group learn."""

    rate: int
    product_shift: int
    """Bits by which rate times trace times error is shifted to the left."""
    weight_shift: int
    """Bits by which a weight is shifted to the left before this product is added."""
    scale: float
    """Factor from the sum to units of the weights."""
    most: int
    """Largest size of a weight, in its units."""
    unit_shift: int
    """Bits by which a weight in its units is shifted to the left."""


class Group(NamedTuple):
    """A group of synapses that learns."""

    core: int
    train_epoch: int
    learn_epoch: int
    decay: float
    magnitude: float
    rule: Rule
    weights: np.ndarray
    """Its weights, (n_axons, n_targets)."""
    traces: np.ndarray
    """Its traces, (n_axons,)."""
    raised: np.ndarray
    """Mask of the axons that a spike arrived at since traces were updated, (n_axons,)."""
    place: np.ndarray | None
    """Places of its weights in the wiring; None if ``weights`` is a view of the wiring's."""
    number: np.ndarray
    """The numbers of the weights that have a place in the wiring."""


class Learning:
    """Traces and weights of the learning synapse groups of an image.

    Parameters
    ----------
    image : ChipImage
        The image.
    wiring : Wiring
        Its wiring; learning updates the weights in it.
    rng : np.random.RandomState
        The chip's stream, shared with noise.

    Attributes
    ----------
    groups : dict of int to Group
        The groups that learn, in the order in which they draw random numbers.

    """

    def __init__(self, image: ChipImage, wiring: Wiring, rng: np.random.RandomState) -> None:
        learning = np.flatnonzero(image.learns)
        # nengo-loihi goes through the groups block by block.
        order = learning[np.argsort(image.groups.block[learning], kind="stable")].tolist()
        sizes = np.diff(image.groups.axon_start)[order]
        ends = np.cumsum([0, *sizes])
        traces = np.zeros(ends[-1], dtype=np.int32)
        self._raised = np.zeros(len(traces), dtype=np.bool_)
        parts = [slice(a, b) for a, b in itertools.pairwise(ends)]
        _, kept = kept_synapses(image)
        in_wiring = np.arange(len(image.synapses))[kept]
        self.groups = {
            group: _group(image, wiring, in_wiring, group, traces[mine], self._raised[mine])
            for group, mine in zip(order, parts, strict=True)
        }
        # Each axon has one delivery, since rows that learn have one atom.
        first = first_contacts(image)[image.groups.axon_start[order]]
        self._trace_of = np.full(len(wiring.run_start), -1, dtype=np.int32)
        for begin, mine, size in zip(first, parts, sizes, strict=True):
            self._trace_of[begin : begin + size] = np.arange(mine.start, mine.stop)
        self._n_cores, self._wiring, self._rng = image.n_cores, wiring, rng
        self._scale = image.manifest.pes_error_scale
        self._t = 0
        self._make_ready()

    def _make_ready(self) -> None:
        make_ready(mark_arrivals, np.zeros(0, dtype=np.int32), self._trace_of, self._raised)
        one, no_numbers = next(iter(self.groups.values())), np.zeros(0)
        make_ready(update_traces, one.traces, one.raised, one.decay, one.magnitude, no_numbers)
        make_ready(update_weights, one.weights, one.traces, one.traces, one.rule, no_numbers)

    def step(self, touched: np.ndarray, errors: Mapping[int, np.ndarray]) -> np.ndarray:
        """Learn from a step's spikes and errors; return counts of weight updates, (n_cores,)."""
        # Epochs count from the first step, as in the emulator: an epoch of 2 acts in steps 2, 4, 6.
        self._t += 1
        if mark_arrivals(touched, self._trace_of, self._raised):
            warnings.warn("Synaptic trace spikes lost", stacklevel=2)
        for one in self.groups.values():
            if self._t % one.train_epoch == 0:
                self._update_traces(one)
        updated = np.zeros(self._n_cores, dtype=np.int64)
        for number, one in self.groups.items():
            if self._t % one.learn_epoch == 0:
                self._update_weights(one, errors.get(number))
                updated[one.core] += one.weights.size
        return updated

    def _update_traces(self, one: Group) -> None:
        # Draw for every trace, even one at zero, so that the stream advances as in the emulator.
        uniform = self._rng.rand(len(one.traces))
        if update_traces(one.traces, one.raised, one.decay, one.magnitude, uniform):
            warnings.warn("Clipping synapse trace", stacklevel=2)

    def _update_weights(self, one: Group, error: np.ndarray | None) -> None:
        uniform = self._rng.rand(one.weights.size)
        pair = np.zeros(one.weights.shape[1], dtype=np.int32)
        if error is not None:
            scaled = _scaled(error, self._scale)
            # Two compartments of opposite sign decode a value: each gets the error with its own
            # sign.
            pair[:] = np.concatenate([-scaled, scaled])
        if update_weights(one.weights, one.traces, pair, one.rule, uniform):
            warnings.warn("Clipping learning weights", stacklevel=2)
        if one.place is not None:
            self._wiring.weights[one.place] = one.weights.ravel()[one.number]


def _scaled(error: np.ndarray, scale: float) -> np.ndarray:
    """Return errors in the chip's integers."""
    rounded = np.round(scale * error)
    if (np.abs(rounded) > LARGEST_ERROR).any():
        warnings.warn(
            f"Received PES error beyond the chip's {LARGEST_ERROR / scale:.2e}. "
            "Consider changing `Model.pes_error_scale`.",
            stacklevel=2,
        )
    # As in the emulator, errors beyond 32 bits become the least integer, whatever their sign.
    return np.clip(rounded.astype(np.int32), -LARGEST_ERROR, LARGEST_ERROR)


def _group(
    image: ChipImage,
    wiring: Wiring,
    in_wiring: np.ndarray,
    group: int,
    traces: np.ndarray,
    raised: np.ndarray,
) -> Group:
    """Return a group at rest; ``in_wiring`` are the numbers of all weights that the wiring has."""
    learning = image.learning_of(group)
    train_epoch = int(learning["train_epoch"])
    mine = part(image.synapse_start, group)
    place = np.flatnonzero((in_wiring >= mine.start) & (in_wiring < mine.stop))
    number = in_wiring[place] - mine.start
    weights = image.synapses.weight[mine].astype(np.int32)
    in_order = len(weights) > 0 and np.array_equal(number, np.arange(len(weights)))
    if in_order:
        # A view: learning writes to the weights that spikes read, without a copy.
        weights = wiring.weights[place[0] : place[0] + len(place)]
    n_targets = 2 * image.error_sizes[group]
    return Group(
        core=int(image.group_core[group]),
        train_epoch=train_epoch,
        learn_epoch=int(learning["learn_epoch"]),
        # Traces decay once in an epoch, for all of its steps.
        decay=float(np.exp(-train_epoch / int(learning["tracing_tau"]))),
        magnitude=learning["tracing_mag"],
        rule=_rule(image, group, learning),
        weights=weights.reshape(len(traces), n_targets),
        traces=traces,
        raised=raised,
        place=None if in_order else place,
        number=number,
    )


def _rule(image: ChipImage, group: int, learning: Mapping[str, float]) -> Rule:
    form = image.format_of(group)
    exponent = LEAST_EXPONENT + form["weight_exp"]
    # A mixed-sign weight spends one bit on its sign, so it is coarser by a factor of 2.
    dropped = 8 - WEIGHT_BITS_OF_CODE[form["weight_bits"]] + (form["fanout_type"] == 1)
    return Rule(
        rate=int(learning["lr_int"]),
        product_shift=LEARN_FRAC + int(learning["lr_exp"]) - OVERFLOW_BITS,
        weight_shift=LEARN_FRAC - exponent,
        scale=2.0 ** (-LEARN_FRAC - dropped),
        most=max(0, (1 << 8 >> dropped) - 1),
        # NumPy's left shift by a negative number gives 0.
        unit_shift=exponent + dropped if exponent + dropped >= 0 else 32,
    )


@compiled
def mark_arrivals(touched: np.ndarray, trace_of: np.ndarray, raised: np.ndarray) -> bool:
    """Mark the axons that spikes arrived at; return whether one was marked before.

    ``trace_of`` has the index of each delivery's trace, or -1.
    """
    lost = False
    for number in touched:
        i = trace_of[number]
        if i >= 0:
            lost |= raised[i]
            # A trace holds one spike between its updates; the emulator loses a second one as well.
            raised[i] = True
    return lost


@compiled
def update_traces(
    traces: np.ndarray, raised: np.ndarray, decay: float, magnitude: float, uniform: np.ndarray
) -> bool:
    """Update the traces of a group, and clear its marks; return whether a trace was clipped."""
    clipped = False
    for i in range(len(traces)):
        trace = decay * traces[i]
        if raised[i]:
            trace += magnitude
        traces[i], beyond = _round(trace, uniform[i], MOST_TRACE)
        clipped |= beyond
        raised[i] = False
    return clipped


@compiled
def update_weights(
    weights: np.ndarray, traces: np.ndarray, errors: np.ndarray, rule: Rule, uniform: np.ndarray
) -> bool:
    """Update the weights (n_axons, n_targets) of a group; return whether one was clipped."""
    clipped = False
    n = len(errors)
    for i in range(len(traces)):
        for j in range(n):
            change = I32(I32(traces[i] * errors[j]) * I32(rule.rate))
            # Weight and change are added with `LEARN_FRAC` fractional bits, and rounded last.
            exact = _shift(weights[i, j], rule.weight_shift)
            exact = I32(exact + _shift(change, rule.product_shift))
            weight, beyond = _round(exact * rule.scale, uniform[i * n + j], rule.most)
            weights[i, j] = _shift(weight, rule.unit_shift)
            clipped |= beyond
    return clipped


@inlined
def _round(x: float, uniform: float, most: int) -> tuple[np.int32, bool]:
    """Round away from zero with the probability of the fraction; return whether it is clipped."""
    size = abs(x)
    whole = np.floor(size)
    rounded = I32(whole) + I32(size - whole > uniform)
    beyond = bool(rounded > most)
    rounded = I32(most) if beyond else I32(rounded)
    return I32(-rounded if x < 0 else rounded), beyond


@inlined
def _shift(x: np.int32, bits: int) -> np.int32:
    """Shift left, or right if ``bits`` is negative; beyond 31 bits the result is NumPy's, too."""
    if bits < 0:
        return I32(x >> min(-bits, 31))
    return I32(x << bits) if bits < 32 else I32(0)
