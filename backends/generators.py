"""The generators of random numbers of Nengo's neurons, which a built model keeps.

Nengo builds them once, and each simulator of a model draws on: a second run would not be the first.
"""

import contextlib
import copy
from collections.abc import Iterator

from nengo.builder import Model
from nengo.builder.neurons import SimNeurons


@contextlib.contextmanager
def own_generators(model: Model) -> Iterator[None]:
    """Let steps that are made of a model draw from copies of its generators, as they were built."""
    neurons = [op for op in model.operators if isinstance(op, SimNeurons)]
    built = [op.state_extra for op in neurons]
    shared: dict[int, object] = {}  # one copy of a generator, however many operators have it
    for op in neurons:
        op.state_extra = copy.deepcopy(op.state_extra, shared)
    try:
        yield
    finally:
        for op, generators in zip(neurons, built, strict=True):
            op.state_extra = generators
