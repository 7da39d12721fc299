"""Decoding of an image's outputs, from the state of compartments to values.

nengo-loihi decodes with NumPy's matrix product, whose rounding depends on how the machine orders
the sum. A sum with at most one nonzero term is rounded the same in any order. Nearly all read-outs
are of this kind, since one compartment of an on/off pair is at zero. Compiled code computes these
sums; in a step where any sum has more nonzero terms, NumPy computes the products of nengo-loihi.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from spikeport.backends.chip import Decoding
from spikeport.backends.native.kernel import decode
from spikeport.backends.sampling import is_sampled
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import flat, part
from spikeport.compiled import make_ready

if TYPE_CHECKING:
    import nengo

Filter: TypeAlias = Callable[[float, np.ndarray], np.ndarray]
MAX_TERMS = 2
"""Most terms of a sum that is worth trying in compiled code."""


class Output:
    """A decoder of one output of an image: it applies weights, then reorders the values."""

    def __init__(self, image: ChipImage, i: int) -> None:
        entry = image.manifest.outputs[i]
        weights = image.decoders.weight[part(image.outputs.weight_start, i)]
        self._matrix = weights.reshape(entry.shape) if entry.weights == "matrix" else None
        self._scale: float | None = weights[0] if entry.weights == "scale" else None
        self._order = None if entry.order is None else np.array(entry.order, dtype=int)
        ends = np.cumsum(entry.segments)
        self._segments = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        # The layout decides which of BLAS's kernels multiplies, hence the rounding.
        matrices = [] if self._matrix is None else [self._matrix[s] for s in self._segments]
        self._parts = [np.array(matrix, order=entry.layout) for matrix in matrices]
        self.size = entry.size

    def decode(self, raw: np.ndarray) -> np.ndarray:
        """Return the value of the output, (size,)."""
        if self._matrix is not None:
            # The calls of nengo-loihi, hence its rounding: a matrix of one row for each segment.
            rows = raw.reshape(1, -1)
            parts = zip(self._segments, self._parts, strict=True)
            result: np.ndarray = sum(rows[:, s].dot(matrix) for s, matrix in parts)[0]
            return result
        value = raw if self._scale is None else raw.dot(self._scale)
        return value if self._order is None else value[self._order]

    def terms(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return, for each value, the entries of the output that it sums, and their weights."""
        if self._matrix is not None:
            return [(np.flatnonzero(column), column[column != 0]) for column in self._matrix.T]
        order = np.arange(self.size) if self._order is None else self._order
        weight = 1.0 if self._scale is None else self._scale
        return [(np.array([entry]), np.array([weight])) for entry in order]


class Decoder:
    """A decoder of several outputs of an image into one array.

    Parameters
    ----------
    image : ChipImage
        The image.
    numbers : sequence of int
        The numbers of the outputs to decode.

    Attributes
    ----------
    size : int
        Length of the array.
    parts : list of slice
        The part of the array that each output fills.
    table : Decoding
        The tables of the outputs for compiled code.
    """

    def __init__(self, image: ChipImage, numbers: Sequence[int]) -> None:
        self._numbers = list(numbers)
        self._outputs = [Output(image, number) for number in numbers]
        ends = np.cumsum([0] + [output.size for output in self._outputs]).tolist()
        self.parts = [slice(a, b) for a, b in itertools.pairwise(ends)]
        self.size = ends[-1]
        self.table = self._tabulate(image)
        # Compiled here, so that the first step does not wait for it.
        make_ready(decode, np.zeros(0, dtype=np.int32), *self.table, np.zeros(0))

    def _tabulate(self, image: ChipImage) -> Decoding:
        terms = [term for output in self._outputs for term in output.terms()]
        # On/off pairs have two terms, one of them nearly always zero. Longer sums are seldom so
        # sparse: trying them first would cost more than it saves.
        if any(len(entries) > MAX_TERMS for entries, _ in terms):
            terms = []
        firsts = np.repeat(image.outputs.start[self._numbers], [o.size for o in self._outputs])
        return Decoding(
            start=np.cumsum([0] + [len(entries) for entries, _ in terms]),
            indices=flat([first + e for first, (e, _) in zip(firsts, terms, strict=False)]),
            weights=flat([weights for _, weights in terms], float),
        )

    def decode(self, held: Sequence[np.ndarray], values: np.ndarray) -> None:
        """Write the decoded values, from the states of every output of the image."""
        if not self._numbers:
            return
        # `decode` returns False if a sum had several nonzero terms: its rounding depends on their
        # order.
        if len(self.table.start) > 1 and decode(np.concatenate(held), *self.table, values):
            return
        for output, place, number in zip(self._outputs, self.parts, self._numbers, strict=True):
            values[place] = output.decode(held[number])


class OutputRecording:
    """The recording of an output by a probe, decoded and filtered when its data is read.

    With a sampling interval, each step is decoded at once if its value is due or the filter needs
    it, and only samples are kept: a long run with few of them takes little memory.

    Parameters
    ----------
    image : ChipImage
        The image.
    number : int
        The number of the recorded output.
    probe : nengo.Probe
        The probe, with its filter and its sampling interval.
    """

    def __init__(self, image: ChipImage, number: int, probe: "nengo.Probe") -> None:
        self._number = number
        self._output = Output(image, number)
        self._raw: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self._dt_s = image.manifest.dt_s
        self._sample_every = probe.sample_every
        self._filter = self._make_filter(probe.synapse)
        self._filtered = probe.synapse is not None
        self._n_steps = 0

    def _make_filter(self, synapse: "nengo.synapses.Synapse | None") -> Filter:
        # Filtered in float32, as nengo-loihi filters its probes. Kept in float64: nengo-loihi
        # does so with decoded values, but cuts voltages and currents to integers.
        if synapse is None:
            return lambda _t, x: x
        shape = (self._output.size,)
        state = synapse.make_state(shape, shape, self._dt_s, dtype=np.float32)
        step: Filter = synapse.make_step(shape, shape, self._dt_s, rng=None, state=state)
        return step

    def append(self, held: Sequence[np.ndarray]) -> None:
        """Record a step, from the states of every output of the image."""
        # A copy keeps steps cheap: decoding waits until the data is read.
        self._raw.append(held[self._number].copy())
        if self._sample_every is not None:
            self._digest()

    def data(self) -> np.ndarray:
        """Return the values of the sampled steps since the last clearing, (n, size)."""
        self._digest()
        return np.array(self._values).reshape(len(self._values), self._output.size)

    def clear(self) -> None:
        """Forget the recorded values; the filter keeps its state."""
        self._digest()
        self._values.clear()

    def _digest(self) -> None:
        for raw in self._raw:
            self._n_steps += 1
            due = is_sampled(self._n_steps, self._sample_every, self._dt_s)
            if not (due or self._filtered):
                continue
            value = self._output.decode(raw)
            filtered = self._filter(0.0, value)  # in an array that the filter reuses
            if due:
                self._values.append(np.array(filtered, dtype=float if self._filtered else None))
        self._raw.clear()
