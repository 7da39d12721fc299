"""The tape's kernel: simple operations on one array of floats, one after the other, compiled.

Each row of ``code`` is one operation on strided parts of ``memory``:

    [what, n, target, target stride, source, source stride, table, state]

``table`` and ``state`` are offsets into ``tables`` (constants) and ``memory``; ``scalars`` holds
two numbers for each row. Products and sums are rounded one by one, in Nengo's order: no fused
multiply-add, so that the results are Nengo's, bit for bit.
"""

import numpy as np

from spikeport.compiled import compiled

FILL, COPY, ADD, SCALE_ADD, GATHER_ADD, RELU, LOWPASS, LOWPASS_ADD, GAIN = range(9)


@compiled
def run_tape(memory: np.ndarray, code: np.ndarray, scalars: np.ndarray, tables: np.ndarray) -> None:
    """Run all operations of a tape."""
    for k in range(len(code)):
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
        else:
            _lowpass(memory, code[k], a, b)


@compiled
def _lowpass(memory: np.ndarray, row: np.ndarray, a: float, b: float) -> None:
    what, n, y, dy, x, dx, _, state = row
    for i in range(n):
        kept = memory[state + i] * a
        kept += b * memory[x + i * dx]
        memory[state + i] = kept
        memory[y + i * dy] = kept if what == LOWPASS else memory[y + i * dy] + kept
