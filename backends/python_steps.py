"""Steps of Nengo's operators that stay in Python, with less overhead.

These operators are users' functions, and products whose rounding depends on how NumPy orders their
sums. Nengo checks and copies with several NumPy calls, each of which costs more than a small node's
own function. The steps here use fewer calls, and leave every unusual value to Nengo's own step.
"""

from collections.abc import Callable

import numpy as np
from nengo.builder.operator import SimPyFunc
from nengo.builder.signal import SignalDict
from nengo.exceptions import SimulationError

from spikeport.compile.ground.refusal import without_addresses
from spikeport.node_functions import Skippable


def product_step(
    matrix: np.ndarray, vector: np.ndarray, target: np.ndarray, kept: np.ndarray
) -> Callable[[], None]:
    """Return a step that adds a constant matrix times a vector, and keeps the product."""

    def add() -> None:
        kept[...] = np.dot(matrix, vector)
        target[...] += kept

    return add


def waiting_step(
    call: Callable[[], None], function: Skippable, left: np.ndarray
) -> Callable[[], None]:
    """Return a step that calls a function, and stores the number of steps to skip in ``left``."""

    def wait() -> None:
        call()
        left[0] = function.skip()

    function.left = left
    return wait


def function_step(op: SimPyFunc, signals: SignalDict) -> Callable[[], None]:
    """Return a step that calls a user's function, and stores the finite numbers it returns."""
    function, arguments = op.fn, _arguments(op, signals)
    output = None if op.output is None else signals[op.output]

    refer = _nengo_keeps(op, signals)

    def call() -> None:
        value = function(*arguments())
        if output is not None and not _kept(value, output):
            refer(value)

    return call


def _kept(value: object, output: np.ndarray) -> bool:
    """Store a value if it is an array of finite numbers that fits; return whether it was."""
    if type(value) is not np.ndarray:
        return False
    try:
        finite = np.count_nonzero(np.isfinite(value)) == value.size
        if finite:
            output[...] = value
    except (TypeError, ValueError):
        return False
    result: bool = finite
    return result


def _arguments(op: SimPyFunc, signals: SignalDict) -> Callable[[], tuple[object, ...]]:
    time = None if op.t is None else signals[op.t].item
    copy = None if op.x is None else signals[op.x].copy
    if time is None:
        return (lambda: ()) if copy is None else (lambda: (copy(),))
    return (lambda: (time(),)) if copy is None else (lambda: (time(), copy()))


def _nengo_keeps(op: SimPyFunc, signals: SignalDict) -> Callable[[object], None]:
    """Return a function that runs Nengo's step of an operator on a value in place of its call."""

    def keep(value: object) -> None:
        stand_in = SimPyFunc(op.output, lambda: value, None, None)
        stand_in.fn.__name__ = getattr(op.fn, "__name__", type(op.fn).__name__)
        try:
            stand_in.make_step(signals, 0.0, None)()
        except SimulationError as error:
            # Nengo's text names the function, and many nodes have one called <lambda>.
            error.add_note("in " + without_addresses(op.output.name.removesuffix(".out")))
            raise

    return keep
