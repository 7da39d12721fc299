"""The tape's kernel: simple operations on one array of floats, one after the other, compiled.

Each row of ``code`` is one operation on strided parts of ``memory``:

    [what, n, target, target stride, source, source stride, table, state]

``table`` and ``state`` are offsets into ``tables`` (constants, and what operations keep) and
``memory``; ``scalars`` holds two numbers for each row. Products and sums are rounded one by one, in
Nengo's order: no fused multiply-add, so that the results are Nengo's, bit for bit.

What is not compiled is Python's to do, and the tape stops there. It goes on where the last value
still holds: a held function and a product keep their input, and are computed anew when a bit of it
changes; a waiting function is not called for some steps. Their tables, and that of the clock:

    HELD      [1 if an input is kept, the input]                 n inputs
    PRODUCT   [1 if an input is kept, the input, the product]    n outputs, ``state`` inputs
    WAIT      [steps for which the value stays]
    CLOCK     [steps so far]
"""

import numpy as np

from spikeport.compiled import compiled

FILL, COPY, ADD, SCALE_ADD, GATHER_ADD, RELU, LOWPASS, LOWPASS_ADD, GAIN = range(9)
AFFINE, CLOCK, HELD, PRODUCT, WAIT, CALL = range(9, 15)


@compiled
def run_tape(
    memory: np.ndarray, code: np.ndarray, scalars: np.ndarray, tables: np.ndarray, begin: int
) -> int:
    """Run the operations from ``begin`` on; return the first that is Python's, or their number."""
    for k in range(begin, len(code)):
        what, n, y, dy, x, dx, table, state = code[k]
        a, b = scalars[k]
        if what == FILL:
            for i in range(n):
                memory[y + i * dy] = a
        elif what == COPY:
            for i in range(n):
                memory[y + i * dy] = memory[x + i * dx]
        elif what == ADD:
            for i in range(n):
                memory[y + i * dy] += memory[x + i * dx]
        elif what == SCALE_ADD:
            for i in range(n):
                memory[y + i * dy] += tables[table + i] * memory[x + i * dx]
        elif what == GATHER_ADD:
            for i in range(n):
                j = int(tables[table + n + i])
                memory[y + i * dy] += tables[table + i] * memory[x + j * dx]
        elif what == RELU:
            for i in range(n):
                voltage = memory[state + i] + max(memory[x + i * dx], 0.0) * b
                spikes = np.floor(voltage)
                memory[y + i * dy] = a * spikes
                memory[state + i] = voltage - spikes
        elif what == GAIN:
            for i in range(n):
                memory[y + i * dy] = a * memory[x + i * dx]
        elif what in (LOWPASS, LOWPASS_ADD):
            _lowpass(memory, code[k], a, b)
        elif what == CLOCK:
            tables[table] += 1
            memory[y] = tables[table] * a
        elif not _without_python(memory, code[k], a, b, tables):
            return k
    return len(code)


@compiled
def _lowpass(memory: np.ndarray, row: np.ndarray, a: float, b: float) -> None:
    what, n, y, dy, x, dx, _, state = row
    for i in range(n):
        kept = memory[state + i] * a
        kept += b * memory[x + i * dx]
        memory[state + i] = kept
        memory[y + i * dy] = kept if what == LOWPASS else memory[y + i * dy] + kept


@compiled
def _without_python(
    memory: np.ndarray, row: np.ndarray, a: float, b: float, tables: np.ndarray
) -> bool:
    """Do what Python need not in this step; return False where it must."""
    what, n, y, dy, x, dx, table, n_in = row
    if what == WAIT and tables[table] > 0:
        tables[table] -= 1
        return True
    if what == HELD:
        return _unchanged(memory, x, dx, n, tables, table)
    if what == AFFINE:
        return _affine(memory, row, a, b)
    if what == PRODUCT and _unchanged(memory, x, dx, n_in, tables, table):
        for i in range(n):
            memory[y + i * dy] += tables[table + 1 + n_in + i]
        return True
    return False


@compiled
def _unchanged(memory: np.ndarray, x: int, dx: int, n: int, tables: np.ndarray, table: int) -> bool:
    """Return whether an input has the bits of the one that is kept; else keep it."""
    # As integers: NaN differs from itself as a float, and 0.0 does not from -0.0.
    now, kept = memory.view(np.int64), tables[table + 1 : table + 1 + n].view(np.int64)
    same = tables[table] == 1
    for i in range(n):
        same &= kept[i] == now[x + i * dx]
        kept[i] = now[x + i * dx]
    tables[table] = 1
    return same


@compiled
def _affine(memory: np.ndarray, row: np.ndarray, a: float, b: float) -> bool:
    """Compute a node's ``b + a x``; return False where a value is not finite, for an error."""
    _, n, y, dy, x, dx, _, _ = row
    finite = True
    for i in range(n):
        value = b + a * memory[x + i * dx]
        memory[y + i * dy] = value
        finite &= np.isfinite(value)
    return finite
