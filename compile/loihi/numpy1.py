"""NumPy 1 semantics for nengo-loihi 1.1.0, which was written before NumPy 2.

Two of its habits changed meaning:

- ``np.array(x, copy=False)`` asked for a copy only where one is needed; NumPy 2 raises instead.
- The largest weight, bias and threshold of a block are float32 scalars. Together with a Python
  number, NumPy 1 computed in float64, but NumPy 2 stays in float32 (NEP 50). The scales derived
  from them differ in their last bits, so that a chip would be programmed differently.

Inside `numpy1_semantics` both have their old meaning; outside, nothing changes. Threads take turns.
"""

import contextlib
from collections.abc import Iterator
from typing import Any

import nengo_loihi.block
import nengo_loihi.builder.discretize
import nengo_loihi.neurons
import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from spikeport.compile.ground.notices import TURN
from spikeport.compile.loihi.replaced import StandIn, replaced

_discretize_compartment = nengo_loihi.builder.discretize.discretize_compartment
_NUMPY_2 = int(np.__version__.split(".")[0]) >= 2


def _array(
    value: ArrayLike, dtype: DTypeLike | None = None, copy: bool = True, ndmin: int = 0
) -> np.ndarray:
    """Return an array; with ``copy=False``, copy only where a copy is needed."""
    return np.array(value, dtype=dtype, copy=copy or None, ndmin=ndmin)


class WideMax(np.ndarray):
    """An array whose `max` is a Python float, so that arithmetic with it is in float64."""

    def max(self, *args: Any, **kwargs: Any) -> Any:  # noqa: D102
        return float(super().max(*args, **kwargs))


def _wide_max_abs_weight(synapse: nengo_loihi.block.Synapse) -> float:
    return float(max(np.abs(w).max() if w.size else -np.inf for w in synapse.weights))


def _wide_discretize_compartment(
    compartment: nengo_loihi.block.Compartment, w_max: float
) -> dict[str, float]:
    compartment.bias = compartment.bias.view(WideMax)
    compartment.vth = compartment.vth.view(WideMax)
    try:
        result: dict[str, float] = _discretize_compartment(compartment, w_max)
        return result
    finally:
        compartment.bias = np.asarray(compartment.bias)
        compartment.vth = np.asarray(compartment.vth)


@contextlib.contextmanager
def numpy1_semantics() -> Iterator[None]:
    """Let nengo-loihi's builder and discretiser compute as they did under NumPy 1."""
    with TURN, numpy1_semantics_without_turns():
        yield


@contextlib.contextmanager
def numpy1_semantics_without_turns() -> Iterator[None]:
    """Do the same, but take no turns: a user's code may wait for threads that compile."""
    patches: list[tuple[object, str, object]] = [
        (nengo_loihi.block.Synapse, "max_abs_weight", _wide_max_abs_weight),
        (
            nengo_loihi.builder.discretize,
            "discretize_compartment",
            _wide_discretize_compartment,
        ),
    ]
    if _NUMPY_2:
        numpy = StandIn(np, array=_array)
        patches += [(m, "np", numpy) for m in (nengo_loihi.block, nengo_loihi.neurons)]
    with contextlib.ExitStack() as stack:
        for patch in patches:
            stack.enter_context(replaced(*patch, turn=contextlib.nullcontext()))
        yield
