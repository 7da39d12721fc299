"""Nengo's operators as a tape of compiled operations, with Python only where it is needed.

Nengo runs each operator of a model as a Python closure over NumPy arrays; for the few numbers of a
control loop the calls cost far more than the arithmetic. Here all signals lie in one array, and
operators become a tape (`spikeport.backends.tape_kernel`). At an operator that is not simple enough
the tape stops, and calls Nengo's own closure or a faster replacement before it goes on.
"""

import functools
import inspect
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import nengo
import numpy as np
from nengo.builder.neurons import SimNeurons
from nengo.builder.operator import (
    Copy,
    DotInc,
    ElementwiseInc,
    Operator,
    Reset,
    SimPyFunc,
    TimeUpdate,
)
from nengo.builder.probe import SimProbe
from nengo.builder.processes import SimProcess
from nengo.builder.signal import Signal
from nengo.synapses import LinearFilter

from spikeport.backends import tape_kernel as kernel
from spikeport.backends.pooled_signals import PooledSignals
from spikeport.backends.python_steps import function_step, product_step, waiting_step
from spikeport.compiled import make_ready
from spikeport.node_functions import Affine, Held, Skippable

Placed: TypeAlias = tuple[np.ndarray, tuple[int, int]]
"""An array, and its offset and stride in the pool."""
Stop: TypeAlias = Callable[[np.ndarray], Callable[[], None]]
"""Returns the function that Python calls where an operation stops, from the operation's table."""
NOTHING = np.zeros(0)


class Code(NamedTuple):
    """The integers of an operation; see `spikeport.backends.tape_kernel`."""

    what: int
    n: int = 0
    target: int = 0
    target_stride: int = 0
    source: int = 0
    source_stride: int = 0
    table: int = 0
    state: int = 0


class Operation(NamedTuple):
    """An operation of a tape."""

    code: Code
    scalars: tuple[float, float] = (0.0, 0.0)
    table: np.ndarray = NOTHING
    """Its constants, and the values that it keeps between steps."""
    stop: Stop | None = None
    """None if it never stops."""


class Tape:
    """A tape under construction: its operations and their constants."""

    def __init__(self, memory: np.ndarray) -> None:
        self._memory = memory
        self._operations: list[Operation] = []
        self._n_constants = 0

    def add(self, operation: Operation) -> None:
        """Append an operation, with its constants and the function to call where it stops."""
        # Tables lie end to end in one array, and operations find theirs by offset.
        code = operation.code._replace(table=self._n_constants)
        self._n_constants += len(operation.table)
        self._operations.append(operation._replace(code=code))

    def finish(self) -> Callable[[], None]:
        """Return a function that runs the tape."""
        memory, operations, n = self._memory, self._operations, len(self._operations)
        code = np.array([one.code for one in operations], dtype=np.int64).reshape(n, 8)
        scalars = np.array([one.scalars for one in operations], dtype=np.float64).reshape(n, 2)
        tables = np.concatenate([NOTHING, *(one.table for one in operations)])
        run_tape = make_ready(kernel.run_tape, memory, code, scalars, tables, 0)
        stops = {
            k: one.stop(tables[one.code.table : one.code.table + len(one.table)])
            for k, one in enumerate(operations)
            if one.stop is not None
        }

        def run() -> None:
            k = run_tape(memory, code, scalars, tables, 0)
            if k == n:
                return
            with np.errstate(invalid="raise", divide="ignore"):  # as Nengo does
                while k < n:
                    stops[k]()
                    k = run_tape(memory, code, scalars, tables, k + 1)

        return run


class Flattener:
    """A compiler of a simulator's operators into a function to call in each step.

    Parameters
    ----------
    sim : nengo.Simulator
        The simulator of the operators, which is made to use ``signals``.
    signals : PooledSignals
        The signals of its model.
    ports : dict of int to array
        Arrays in the pool that stand for processes at the edge of the host, by the process's id.
        A sending process copies its input to its array; a receiving one returns its array's values.
    """

    def __init__(
        self, sim: nengo.Simulator, signals: PooledSignals, ports: dict[int, np.ndarray]
    ) -> None:
        self._sim = sim
        self._signals = signals
        self._ports = ports
        sim.signals = signals
        # The reset makes Nengo build its closures anew, over the arrays of the pool.
        sim.reset(sim.seed)
        self._closures = dict(zip(sim._step_order, sim._steps, strict=True))
        # By exact type: a subclass can do something else.
        self._compilers: dict[type, Callable[[Any], Operation | None]] = {
            TimeUpdate: self._clock,
            Reset: self._reset,
            Copy: self._copy,
            ElementwiseInc: self._elementwise,
            DotInc: self._dot,
            SimNeurons: self._neurons,
            SimProcess: self._process,
            SimPyFunc: self._function,
        }

    def step(self) -> Callable[[], None]:
        """Return a function that runs all operators, in the order in which Nengo runs them."""
        tape = Tape(self._signals.memory)
        for op in self._sim._step_order:
            if type(op) is not SimProbe:  # it computes nothing: it only names a probed signal
                tape.add(self._compile(op) or self._call(self._closures[op]))
        return tape.finish()

    def _compile(self, op: Operator) -> Operation | None:
        compiler = self._compilers.get(type(op))
        return None if compiler is None else compiler(op)

    @staticmethod
    def _call(function: Callable[[], None]) -> Operation:
        return Operation(Code(kernel.CALL), stop=lambda _: function)

    def _operation(
        self,
        what: int,
        target: Signal | np.ndarray,
        source: Signal | np.ndarray,
        a: float = 0.0,
        b: float = 0.0,
    ) -> Operation | None:
        """Return an element-wise operation; None if sizes differ or an array is not in the pool."""
        y_array = target if isinstance(target, np.ndarray) else self._signals[target]
        x_array = source if isinstance(source, np.ndarray) else self._signals[source]
        y, x = self._signals.place(y_array), self._signals.place(x_array)
        if y is None or x is None or x_array.size not in (1, y_array.size):
            return None
        # With a stride of 0 a tape reads one number for all targets, as NumPy broadcasts it.
        stride = 0 if x_array.size == 1 else x[1]
        return Operation(Code(what, y_array.size, *y, x[0], stride), (a, b))

    def _clock(self, op: TimeUpdate) -> Operation | None:
        found = self._operation(kernel.CLOCK, op.time, op.time, self._sim.dt)
        return found and found._replace(table=np.zeros(1))

    def _reset(self, op: Reset) -> Operation | None:
        return self._operation(kernel.FILL, op.dst, op.dst, op.value)

    def _copy(self, op: Copy) -> Operation | None:
        # Slices may be lists of indices, which a stride cannot express.
        if op.src_slice is not None or op.dst_slice is not None:
            return None
        return self._operation(kernel.ADD if op.inc else kernel.COPY, op.dst, op.src)

    def _elementwise(self, op: ElementwiseInc) -> Operation | None:
        factor = self._signals[op.A]
        found = self._operation(kernel.SCALE_ADD, op.Y, op.X)
        target, source = self._signals[op.Y], self._signals[op.X]
        if found is None or not op.A.readonly or factor.size not in (1, target.size):
            return None
        if source.ndim > 1 or target.ndim > 1 or source.size != target.size:
            return None
        table = np.broadcast_to(factor.reshape(-1), (target.size,)).astype(float)
        return found._replace(table=table)

    def _dot(self, op: DotInc) -> Operation | None:
        """Return a product; NumPy computes sums of several terms, since their order matters."""
        if not _constant_matrix(op):
            return None
        matrix, source = self._signals[op.A], self._signals[op.X]
        target = self._signals[op.Y]
        y, x = self._signals.place(target), self._signals.place(source)
        if y is None or x is None:
            return None
        if np.count_nonzero(matrix, axis=1).max() > 1:
            return self._product(matrix, (source, x), (target, y))
        # The column of a row's one nonzero entry; in a row of zeros the first, which adds nothing.
        column = np.abs(matrix).argmax(axis=1)
        table = np.concatenate([matrix[np.arange(len(matrix)), column], column])
        return Operation(Code(kernel.GATHER_ADD, target.size, *y, *x), table=table)

    @staticmethod
    def _product(matrix: np.ndarray, source: Placed, target: Placed) -> Operation:
        (vector, x), (total, y) = source, target
        begin, table = 1 + vector.size, np.zeros(1 + vector.size + total.size)
        return Operation(
            Code(kernel.PRODUCT, total.size, *y, *x, state=vector.size),
            table=table,
            stop=lambda kept: product_step(matrix, vector, total, kept[begin:]),
        )

    def _function(self, op: SimPyFunc) -> Operation:
        """Return a user's function; some kinds the tape computes itself, or need not call."""
        function, call = op.fn, function_step(op, self._signals)
        stops = self._call(call)
        if isinstance(function, Skippable):
            return Operation(
                Code(kernel.WAIT),
                table=np.zeros(1),
                stop=lambda left: waiting_step(call, function, left),
            )
        if op.x is None or op.output is None:
            return stops
        if type(function) is Affine and op.x.size == op.output.size:
            factors = function.factor, function.offset
            found = self._operation(kernel.AFFINE, op.output, op.x, *factors)
        elif type(function) is Held:
            found = self._operation(kernel.HELD, op.x, op.x)
            found = found and found._replace(table=np.zeros(1 + op.x.size))
        else:
            found = None
        return stops if found is None else found._replace(stop=stops.stop)

    def _neurons(self, op: SimNeurons) -> Operation | None:
        neurons, dt = op.neurons, self._sim.dt
        # Subclasses and other types have equations that the tape lacks.
        if type(neurons) is not nengo.SpikingRectifiedLinear:
            return None
        found = self._operation(kernel.RELU, op.output, op.J, neurons.amplitude / dt, dt)
        return self._with_state(found, self._signals[op.state["voltage"]])

    def _with_state(self, found: Operation | None, state: np.ndarray) -> Operation | None:
        place = self._signals.place(state)
        if found is None or place is None or place[1] != 1:
            return None
        return found._replace(code=found.code._replace(state=place[0]))

    def _process(self, op: SimProcess) -> Operation | None:
        port = self._ports.get(id(op.process))
        if port is not None:
            return self._port(op, port)
        if not isinstance(op.process, LinearFilter) or op.input is None:
            return None
        return self._filter(op)

    def _port(self, op: SimProcess, port: np.ndarray) -> Operation:
        """Return a copy of values that enter or leave the host."""
        target, source = (op.output, port) if op.input is None else (port, op.input)
        found = self._operation(kernel.COPY, target, source)
        if found is not None:
            return found
        # Signals of single precision are not in the pool. Copy them here: the process at the edge
        # computes nothing.
        to, taken = (one if one is port else self._signals[one] for one in (target, source))
        return self._call(functools.partial(np.copyto, to, taken))

    def _filter(self, op: SimProcess) -> Operation | None:
        step = process_step(self._closures[op])
        adds = op.mode == "inc"
        if type(step) is LinearFilter.NoX and not adds:
            return self._operation(kernel.GAIN, op.output, op.input, step.d)
        if type(step) not in (LinearFilter.OneX, LinearFilter.OneXScalar):
            return None
        what = kernel.LOWPASS_ADD if adds else kernel.LOWPASS
        found = self._operation(what, op.output, op.input, step.a, step.b)
        return self._with_state(found, step.X)


def _constant_matrix(op: DotInc) -> bool:
    """Return whether an operator adds a constant matrix times a vector to a vector."""
    return bool(op.A.readonly) and (op.A.ndim, op.X.ndim, op.Y.ndim) == (2, 1, 1)


def process_step(closure: Callable[[], None]) -> LinearFilter.Step:
    """Return the step function of a process, which Nengo keeps in its operator's closure."""
    return inspect.getclosurevars(closure).nonlocals["step_f"]
