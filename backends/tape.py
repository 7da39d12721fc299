"""Nengo operators -> a tape of compiled operations, with Python only where a user's function is.

Nengo runs each operator of a model as a Python closure over NumPy arrays; for the few numbers of a
control loop the calls cost far more than the arithmetic. Here all signals lie in one array, and
stretches of operators that are simple enough become tapes (`spikeport.backends.tape_kernel`). An
operator that is not keeps Nengo's own closure, in its place in the order.
"""

import inspect
import itertools
from collections.abc import Callable

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
from nengo.builder.processes import SimProcess
from nengo.builder.signal import Signal, SignalDict
from nengo.synapses import LinearFilter

from spikeport.backends import tape_kernel as kernel
from spikeport.backends.compiled import make_ready
from spikeport.backends.python_steps import clock_step, function_step, product_step

TapeRow = tuple[list[int], list[float]]


class PooledSignals(SignalDict):
    """Nengo's signal dictionary, with all floats but constant matrices in one array, ``memory``."""

    def __init__(self, model: nengo.builder.Model, extra: int = 0) -> None:
        super().__init__()
        bases = {s.base for op in model.operators for s in op.all_signals}
        size = sum(s.size for s in bases if _pooled(s))
        self.memory = np.zeros(size + extra)
        self._end = 0
        # This calls `init` below, which takes memory from the pool.
        for operator in model.operators:
            operator.init_signals(self)

    def init(self, signal: Signal) -> None:
        """Set up a signal, in the pool if it can be."""
        if signal.is_view or not _pooled(signal):
            super().init(signal)
            return
        data = self.allocate(signal.size).reshape(signal.shape)
        data[...] = signal.initial_value
        data.setflags(write=not signal.readonly)
        # Nengo's own item assignment copies into an array that exists, and refuses a new key.
        dict.__setitem__(self, signal, data)

    def allocate(self, size: int) -> np.ndarray:
        """Return the next free part of the pool."""
        begin, self._end = self._end, self._end + size
        return self.memory[begin : self._end]

    def place(self, array: np.ndarray) -> tuple[int, int] | None:
        """Return the offset and stride of a one-dimensional array in the pool; else None."""
        if array.dtype != np.float64 or not np.may_share_memory(array, self.memory):
            return None
        flat = array.reshape(-1) if array.flags.c_contiguous else array
        # A tape walks with one stride: an array of two would need more.
        if flat.ndim != 1:
            return None
        address = flat.__array_interface__["data"][0]
        # Bytes to numbers of 8 bytes: the pool is float64 alone.
        offset = (address - self.memory.__array_interface__["data"][0]) // 8
        return offset, flat.strides[0] // 8


def _constant_matrix(op: DotInc) -> bool:
    """Return whether an operator adds a constant matrix times a vector to a vector."""
    return bool(op.A.readonly) and (op.A.ndim, op.X.ndim, op.Y.ndim) == (2, 1, 1)


def _pooled(signal: Signal) -> bool:
    # A tape takes the entries of a constant matrix into its table, and never reads the matrix.
    matrix = signal.readonly and signal.ndim > 1
    return not (signal.is_view or signal.sparse or matrix) and signal.dtype == np.float64


class Tape:
    """Operations and constants under construction, to be run as one."""

    def __init__(self, memory: np.ndarray) -> None:
        self._memory = memory
        self._rows: list[TapeRow] = []
        self._tables: list[np.ndarray] = [np.zeros(0)]

    def add(self, row: TapeRow, table: np.ndarray | None = None) -> None:
        """Append an operation, with its constants."""
        if table is not None:
            # Tables lie end to end in one array, and operations find theirs by offset.
            row[0][6] = sum(map(len, self._tables))
            self._tables.append(table)
        self._rows.append(row)

    def finish(self) -> Callable[[], None]:
        """Return a function that runs the tape."""
        memory, tables = self._memory, np.concatenate(self._tables)
        code = np.array([row[0] for row in self._rows], dtype=np.int64)
        scalars = np.array([row[1] for row in self._rows])
        make_ready(kernel.run_tape, memory, code, scalars, tables)
        return lambda: kernel.run_tape(memory, code, scalars, tables)


class Flattener:
    """A compiler of a simulator's operators into functions to call in turn.

    Parameters
    ----------
    sim : nengo.Simulator
        The simulator of the operators, which is made to use ``signals``.
    signals : PooledSignals
        The signals of its model.
    ports : dict of int to array
        Arrays in the pool that stand for processes at the edge of the host, by the process's id:
        a sending process copies its input there, a receiving one returns the values there.
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
        self._compilers: dict[
            type, Callable[[Operator], tuple[TapeRow, np.ndarray | None] | None]
        ] = {
            Reset: self._reset,
            Copy: self._copy,
            ElementwiseInc: self._elementwise,
            DotInc: self._dot,
            SimNeurons: self._neurons,
            SimProcess: self._process,
        }

    def functions(self) -> list[Callable[[], None]]:
        """Return one function for each tape, and for each operator that is not on one."""
        compiled = [(op, self._compile(op)) for op in self._sim._step_order]
        functions: list[Callable[[], None]] = []
        # Neighbours alone are joined: operators stay in the order in which Nengo runs them.
        for on_tape, group in itertools.groupby(compiled, key=lambda pair: pair[1] is not None):
            if not on_tape:
                functions += [self._python(op) for op, _ in group]
                continue
            tape = Tape(self._signals.memory)
            for _, operation in group:
                assert operation is not None
                tape.add(*operation)
            functions.append(tape.finish())
        return functions

    def _python(self, op: Operator) -> Callable[[], None]:
        # By exact type: a subclass can do something else.
        if type(op) is TimeUpdate:
            return clock_step(op, self._signals, self._sim.dt)
        if type(op) is SimPyFunc:
            return function_step(op, self._signals)
        if type(op) is DotInc and _constant_matrix(op):
            return product_step(op, self._signals)
        result: Callable[[], None] = self._closures[op]
        return result

    def _compile(self, op: Operator) -> tuple[TapeRow, np.ndarray | None] | None:
        compiler = self._compilers.get(type(op))
        return None if compiler is None else compiler(op)

    def _row(
        self, what: int, target: Signal, source: Signal | np.ndarray, a: float = 0.0, b: float = 0.0
    ) -> TapeRow | None:
        """Return a row of equally many targets and sources; None if they do not lie in the pool."""
        y_array = target if isinstance(target, np.ndarray) else self._signals[target]
        x_array = source if isinstance(source, np.ndarray) else self._signals[source]
        y, x = self._signals.place(y_array), self._signals.place(x_array)
        if y is None or x is None or x_array.size not in (1, y_array.size):
            return None
        # With a stride of 0 a tape reads one number for all targets, as NumPy broadcasts it.
        stride = 0 if x_array.size == 1 else x[1]
        return [what, y_array.size, *y, x[0], stride, 0, 0], [a, b]

    def _reset(self, op: Reset) -> tuple[TapeRow, None] | None:
        row = self._row(kernel.FILL, op.dst, op.dst, op.value)
        return row and (row, None)

    def _copy(self, op: Copy) -> tuple[TapeRow, None] | None:
        # Slices may be index lists, for which a stride cannot stand.
        if op.src_slice is not None or op.dst_slice is not None:
            return None
        row = self._row(kernel.ADD if op.inc else kernel.COPY, op.dst, op.src)
        return row and (row, None)

    def _elementwise(self, op: ElementwiseInc) -> tuple[TapeRow, np.ndarray] | None:
        factor = self._signals[op.A]
        row = self._row(kernel.SCALE_ADD, op.Y, op.X)
        target, source = self._signals[op.Y], self._signals[op.X]
        if row is None or not op.A.readonly or factor.size not in (1, target.size):
            return None
        if source.ndim > 1 or target.ndim > 1 or source.size != target.size:
            return None
        return row, np.broadcast_to(factor.reshape(-1), (target.size,)).astype(float)

    def _dot(self, op: DotInc) -> tuple[TapeRow, np.ndarray] | None:
        """Return a product whose sums have one term at most: the order of more would matter."""
        if not _constant_matrix(op):
            return None
        matrix, source = self._signals[op.A], self._signals[op.X]
        target = self._signals[op.Y]
        places = self._signals.place(target), self._signals.place(source)
        if None in places or np.count_nonzero(matrix, axis=1).max() > 1:
            return None
        # The one column that is not zero; in a row of zeros the first, whose factor adds nothing.
        column = np.abs(matrix).argmax(axis=1)
        table = np.concatenate([matrix[np.arange(len(matrix)), column], column])
        (y, dy), (x, dx) = places  # type: ignore[misc]
        return ([kernel.GATHER_ADD, target.size, y, dy, x, dx, 0, 0], [0.0, 0.0]), table

    def _neurons(self, op: SimNeurons) -> tuple[TapeRow, None] | None:
        neurons, dt = op.neurons, self._sim.dt
        # Subclasses and other types have equations that the tape lacks.
        if type(neurons) is not nengo.SpikingRectifiedLinear:
            return None
        row = self._row(kernel.RELU, op.output, op.J, neurons.amplitude / dt, dt)
        return self._with_state(row, self._signals[op.state["voltage"]])

    def _with_state(self, row: TapeRow | None, state: np.ndarray) -> tuple[TapeRow, None] | None:
        place = self._signals.place(state)
        if row is None or place is None or place[1] != 1:
            return None
        row[0][7] = place[0]
        return row, None

    def _process(self, op: SimProcess) -> tuple[TapeRow, None] | None:
        port = self._ports.get(id(op.process))
        if port is not None:
            target, source = (op.output, port) if op.input is None else (port, op.input)
            row = self._row(kernel.COPY, target, source)
            return row and (row, None)
        if not isinstance(op.process, LinearFilter) or op.input is None:
            return None
        return self._filter(op)

    def _filter(self, op: SimProcess) -> tuple[TapeRow, None] | None:
        step = process_step(self._closures[op])
        adds = op.mode == "inc"
        if type(step) is LinearFilter.NoX and not adds:
            row = self._row(kernel.GAIN, op.output, op.input, step.d)
            return row and (row, None)
        if type(step) not in (LinearFilter.OneX, LinearFilter.OneXScalar):
            return None
        what = kernel.LOWPASS_ADD if adds else kernel.LOWPASS
        row = self._row(what, op.output, op.input, step.a, step.b)
        return self._with_state(row, step.X)


def process_step(closure: Callable[[], None]) -> LinearFilter.Step:
    """Return the step function of a process, which Nengo keeps in its operator's closure."""
    return inspect.getclosurevars(closure).nonlocals["step_f"]
