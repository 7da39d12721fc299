"""The tape's kernel: simple operations on one array of floats, one after the other, compiled.

Each row of ``code`` is one operation on strided parts of ``memory``:

    [what, n, target, target stride, source, source stride, table, state]

``table`` and ``state`` are offsets into ``tables`` (constants, and values that operations keep) and
``memory``; ``scalars`` holds two numbers for each row. Products and sums are rounded one by one, in
Nengo's order: no fused multiply-add, so that the results are Nengo's, bit for bit.

The tape stops at an operation that is not compiled, and leaves it to Python. It does not stop if
the last value still holds: a held function and a product keep their input, and are computed again
when a bit of it changes; a waiting function is skipped for some steps. The tables of these
operations, and of the clock:

    HELD      [1 if an input is kept, the input]                 n inputs
    PRODUCT   [1 if an input is kept, the input, the product]    n outputs, ``state`` inputs
    WAIT      [steps for which the value stays]
    CLOCK     [steps so far]
"""

import numpy as np

from spikeport.compiled import compiled, inlined

FILL, COPY, ADD, SCALE_ADD, GATHER_ADD, RELU, LOWPASS, LOWPASS_ADD, GAIN, CLOCK = range(10)
AFFINE, HELD, PRODUCT, WAIT, CALL = range(10, 15)
"""Operations at which a tape may stop."""


@compiled
def run_tape(
    memory: np.ndarray, code: np.ndarray, scalars: np.ndarray, tables: np.ndarray, begin: int
) -> int:
    """Run the operations from ``begin`` on; return the first that needs Python, or their number."""
    for k in range(begin, len(code)):
        what, n, y, dy, x, dx, table, state = code[k]
        a, b = scalars[k]
        if what == CLOCK:
            tables[table] += 1
            memory[y] = tables[table] * a
        elif what > CLOCK:
            if not _without_python(memory, code[k], a, b, tables):
                return k
        elif dy == 1 and dx == 1:
            # A branch of its own: LLVM makes vector instructions if it knows the strides.
            _compute(memory, what, n, (y, 1), (x, 1), (table, state), (a, b), tables)
        else:
            _compute(memory, what, n, (y, dy), (x, dx), (table, state), (a, b), tables)
    return len(code)


@inlined
def _compute(
    memory: np.ndarray,
    what: int,
    n: int,
    target: tuple[int, int],
    source: tuple[int, int],
    offsets: tuple[int, int],
    factors: tuple[float, float],
    tables: np.ndarray,
) -> None:
    """Do one operation; ``target`` and ``source`` are an offset and a stride in ``memory``."""
    # Unsigned indices: numba then needs no check for negative ones. Negative strides wrap around.
    y, dy, x, dx = (
        np.uintp(target[0]),
        np.uintp(target[1]),
        np.uintp(source[0]),
        np.uintp(source[1]),
    )
    table, state, (a, b) = np.uintp(offsets[0]), np.uintp(offsets[1]), factors
    if what == FILL:
        for i in range(np.uintp(n)):
            memory[y + i * dy] = a
    elif what == COPY:
        for i in range(np.uintp(n)):
            memory[y + i * dy] = memory[x + i * dx]
    elif what == ADD:
        for i in range(np.uintp(n)):
            memory[y + i * dy] += memory[x + i * dx]
    elif what == SCALE_ADD:
        for i in range(np.uintp(n)):
            memory[y + i * dy] += tables[table + i] * memory[x + i * dx]
    elif what == GATHER_ADD:
        for i in range(np.uintp(n)):
            j = np.uintp(tables[table + np.uintp(n) + i])
            memory[y + i * dy] += tables[table + i] * memory[x + j * dx]
    elif what == RELU:
        for i in range(np.uintp(n)):
            voltage = memory[state + i] + max(memory[x + i * dx], 0.0) * b
            spikes = np.floor(voltage)
            memory[y + i * dy] = a * spikes
            memory[state + i] = voltage - spikes
    elif what == GAIN:
        for i in range(np.uintp(n)):
            memory[y + i * dy] = a * memory[x + i * dx]
    else:
        for i in range(np.uintp(n)):
            kept = memory[state + i] * a
            kept += b * memory[x + i * dx]
            memory[state + i] = kept
            memory[y + i * dy] = kept if what == LOWPASS else memory[y + i * dy] + kept


@compiled
def _without_python(
    memory: np.ndarray, row: np.ndarray, a: float, b: float, tables: np.ndarray
) -> bool:
    """Do an operation that needs no Python in this step; return False if it does need Python."""
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
    """Keep an input, and return whether its bits equal those of the input kept before."""
    # Compare integers: as floats, NaN differs from itself, and 0.0 equals -0.0.
    now, kept = memory.view(np.int64), tables[table + 1 : table + 1 + n].view(np.int64)
    same = tables[table] == 1
    for i in range(n):
        value = now[x + i * dx]
        same &= kept[i] == value
        kept[i] = value
    tables[table] = 1
    return bool(same)


@compiled
def _affine(memory: np.ndarray, row: np.ndarray, a: float, b: float) -> bool:
    """Compute a node's ``b + a x``; return False if a value is not finite, for Nengo's error."""
    _, n, y, dy, x, dx, _, _ = row
    finite = True
    for i in range(n):
        value = b + a * memory[x + i * dx]
        memory[y + i * dy] = value
        finite &= np.isfinite(value)
    return finite
