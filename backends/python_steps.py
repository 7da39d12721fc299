"""Nengo's operators that stay Python, with less around them.

These are users' functions, and products whose rounding depends on how NumPy orders their sums.
Nengo checks and copies with several NumPy calls, each of which costs more than a small node's own
function. These do the same with fewer, and hand everything odd to Nengo's own step.
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
    """Add a constant matrix times a vector, and keep the product."""

    def add() -> None:
        kept[...] = np.dot(matrix, vector)
        target[...] += kept

    return add


def waiting_step(
    call: Callable[[], None], function: Skippable, left: np.ndarray
) -> Callable[[], None]:
    """Call a function, and keep in ``left`` (1,) for how many steps its value stays."""

    def wait() -> None:
        call()
        left[0] = function.skip()

    function.left = left
    return wait


def function_step(op: SimPyFunc, signals: SignalDict) -> Callable[[], None]:
    """Call a user's function, and keep the finite numbers it returns."""
    function, arguments = op.fn, _arguments(op, signals)
    output = None if op.output is None else signals[op.output]

    refer = _nengo_keeps(op, signals)

    def call() -> None:
        value = function(*arguments())
        if output is not None and not _kept(value, output):
            refer(value)

    return call


def _kept(value: object, output: np.ndarray) -> bool:
    """Return whether the value was an array of finite numbers that fits, and copy it if so."""
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
    """Return Nengo's step of an operator, with a value in place of its function's return value."""

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
