"""The random number generators of Nengo's neurons, which a built model keeps.

Nengo builds them once for all simulators of a model: without copies, a second run would draw other
numbers than the first.
"""

import contextlib
import copy
from collections.abc import Iterator

from nengo.builder import Model
from nengo.builder.neurons import SimNeurons


@contextlib.contextmanager
def own_generators(model: Model) -> Iterator[None]:
    """Let simulators made in this context draw from copies of the model's generators, as built."""
    neurons = [op for op in model.operators if isinstance(op, SimNeurons)]
    built = [op.state_extra for op in neurons]
    shared: dict[int, object] = {}  # one copy of a generator, even if several operators share it
    for op in neurons:
        op.state_extra = copy.deepcopy(op.state_extra, shared)
    try:
        yield
    finally:
        for op, generators in zip(neurons, built, strict=True):
            op.state_extra = generators
