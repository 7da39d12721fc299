"""From what the outputs of an image hold to values.

nengo-loihi decodes with NumPy's matrix product, whose rounding depends on how the machine orders
the sum. A sum with at most one term that is not zero is rounded the same in any order, and nearly
all read-outs are such: of an on/off pair one compartment is at zero. Those are summed in compiled
code; in a step where one is not, NumPy's product is taken as nengo-loihi takes it.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import nengo
import numpy as np

from spikeport.backends.compiled import make_ready
from spikeport.backends.sampling import sampled
from spikeport.backends.tape_kernel import decode
from spikeport.compile.extract import flat
from spikeport.compile.image import ChipImage

MAX_TERMS = 2
"""Terms of a sum that is worth trying in compiled code."""


class Output:
    """Decodes one output of an image: weights, then order."""

    def __init__(self, image: ChipImage, i: int) -> None:
        entry = image.manifest["outputs"][i]
        weights = image["output_weights"][image.part("output_weight_start", i)]
        self._weights: Any = {
            "matrix": lambda: weights.reshape(entry["shape"]),
            "scale": lambda: weights[0],
            "none": lambda: None,
        }[entry["weights"]]()
        self._order = entry["order"]
        ends = np.cumsum(entry["segments"])
        self._segments = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        self._is_matrix = entry["weights"] == "matrix"
        # The layout decides which of BLAS's kernels multiplies, hence the rounding.
        matrices = [self._weights[s] for s in self._segments] if self._is_matrix else []
        self._parts = [np.array(matrix, order=entry["layout"]) for matrix in matrices]
        self.size = entry["shape"][1] if self._is_matrix else int(ends[-1])

    def decode(self, raw: np.ndarray) -> np.ndarray:
        """(size,) the value of the output."""
        if self._is_matrix:
            # Segment by segment, as matrices of one row: nengo-loihi's calls, hence its rounding.
            rows = raw.reshape(1, -1)
            parts = zip(self._segments, self._parts, strict=True)
            return sum(rows[:, s].dot(matrix) for s, matrix in parts)[0]
        value = raw if self._weights is None else raw.dot(self._weights)
        return value if self._order is None else value[self._order]

    def terms(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """For each value, the entries of the output that it weighs, and their weights."""
        if self._is_matrix:
            return [(np.flatnonzero(column), column[column != 0]) for column in self._weights.T]
        order = np.arange(self.size) if self._order is None else self._order
        weight = 1.0 if self._weights is None else self._weights
        return [(np.array([entry]), np.array([weight])) for entry in order]


class Decoder:
    """Decodes several outputs of an image into one array.

    Parameters
    ----------
    image : ChipImage
        The image.
    numbers : sequence of int
        Its outputs to decode.

    Attributes
    ----------
    size : int
        Length of the array.
    parts : list of slice
        The part of each output in it.
    """

    def __init__(self, image: ChipImage, numbers: Sequence[int]) -> None:
        self._numbers = numbers
        self._outputs = [Output(image, number) for number in numbers]
        ends = np.cumsum([0] + [output.size for output in self._outputs]).tolist()
        self.parts = [slice(a, b) for a, b in itertools.pairwise(ends)]
        self.size = ends[-1]
        terms = [term for output in self._outputs for term in output.terms()]
        reads = np.diff(image["output_start"])[list(numbers)]
        firsts = np.repeat(np.cumsum(reads) - reads, [output.size for output in self._outputs])
        self._sparse = all(len(entries) <= MAX_TERMS for entries, _ in terms)
        self._start = np.cumsum([0] + [len(entries) for entries, _ in terms])
        self._index = flat([first + e for first, (e, _) in zip(firsts, terms, strict=True)])
        self._weights = flat([weights for _, weights in terms], float)
        tables = self._start, self._index, self._weights
        make_ready(decode, np.zeros(0, dtype=np.int32), *tables, np.zeros(0))

    def decode(self, held: Sequence[np.ndarray], values: np.ndarray) -> None:
        """Write the values of all outputs, given what every output of the image holds."""
        if not self._numbers:
            return
        mine = [held[number] for number in self._numbers]
        if self._sparse and decode(
            np.concatenate(mine), self._start, self._index, self._weights, values
        ):
            return
        for output, part, one in zip(self._outputs, self.parts, mine, strict=True):
            values[part] = output.decode(one)


class Recording:
    """What a probe of an output recorded, decoded and filtered when it is asked for.

    Parameters
    ----------
    image : ChipImage
        The image.
    number : int
        Its output that is recorded.
    probe : nengo.Probe
        The probe, with its filter and how often it samples.
    """

    def __init__(self, image: ChipImage, number: int, probe: nengo.Probe) -> None:
        self._number = number
        self._output = Output(image, number)
        self._raw: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self._dt_s = image.manifest["dt_s"]
        self._sample_every = probe.sample_every
        self._filter = self._make_filter(probe.synapse)
        self._cleared = 0

    def _make_filter(self, synapse: Any) -> Any:
        if synapse is None:
            return lambda _t, x: x
        shape = (self._output.size,)
        state = synapse.make_state(shape, shape, self._dt_s, dtype=np.float32)
        return synapse.make_step(shape, shape, self._dt_s, rng=None, state=state)

    def append(self, held: Sequence[np.ndarray]) -> None:
        """Record a step, given what every output of the image holds."""
        self._raw.append(held[self._number].copy())

    def data(self) -> np.ndarray:
        """(n, size) the values of the steps it sampled, since it was last cleared."""
        self._digest()
        n = self._cleared + len(self._values)
        steps = sampled(n, self._sample_every, self._dt_s) - 1 - self._cleared
        values = np.array(self._values).reshape(len(self._values), self._output.size)
        return values[steps[steps >= 0]]

    def clear(self) -> None:
        """Forget what was recorded; the filter keeps its state."""
        self._digest()
        self._cleared += len(self._values)
        self._values.clear()

    def _digest(self) -> None:
        for raw in self._raw:
            filtered = self._filter(0.0, self._output.decode(raw))
            self._values.append(np.array(filtered))  # a filter reuses its array
        self._raw.clear()
