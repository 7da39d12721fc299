"""The signals of a network on the host, all in one array."""

import nengo
import numpy as np
from nengo.builder.signal import Signal, SignalDict


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
        # A tape has one stride for an array: two dimensions would need two.
        if flat.ndim != 1:
            return None
        address = flat.__array_interface__["data"][0]
        # From bytes to numbers of 8 bytes: the pool holds only float64.
        offset = (address - self.memory.__array_interface__["data"][0]) // 8
        return offset, flat.strides[0] // 8


def _pooled(signal: Signal) -> bool:
    # A tape takes the entries of a constant matrix into its table, and never reads the matrix.
    matrix = signal.readonly and signal.ndim > 1
    return not (signal.is_view or signal.sparse or matrix) and signal.dtype == np.float64
