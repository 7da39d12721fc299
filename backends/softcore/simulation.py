"""Soft cores in Verilator, loaded with a memory image."""

import ctypes
from typing import NamedTuple

import numpy as np

from spikeport.arrays import pointer
from spikeport.backends.softcore.memory import MemoryImage, Select
from spikeport.backends.softcore.verilated import Build, library
from spikeport.errors import BackendError

STATE = ("u", "v", "q", "refractory", "spiked")
MOST_CYCLES = 1 << 26
"""Cycles after which a step is given up."""


class CoreStep(NamedTuple):
    """A step of the cores.

    Attributes
    ----------
    cycles : int
        Cycles from the beginning of the step until nothing is under way.
    weights : (n_cores,) array
        Number of weights that were added on each core, including zeros that bridge gaps.
    messages : int
        Messages that the bus moved.
    """

    cycles: int
    weights: np.ndarray
    messages: int


class Simulation:
    """Soft cores with the contents of a memory image, at rest.

    Parameters
    ----------
    memory : MemoryImage
        The memory contents that the host writes.
    build : Build, optional
        A chip to use instead of one with as many cores as are used.

    Attributes
    ----------
    state : (n_compartments, 5) array
        u, v, q, refractory steps and spike of each compartment after a step, core by core.
    """

    def __init__(self, memory: MemoryImage, build: Build | None = None) -> None:
        n_cores = len(memory.cores)
        build = build or Build(n_cores, memory.unit)
        self._library = library(build)
        self._library.softcore_open.restype = ctypes.c_void_p
        self._library.softcore_step.restype = ctypes.c_int64
        self.state = np.zeros((len(memory.order), len(STATE)), dtype=np.int32)
        self._counts = np.zeros(build.cores + 1, dtype=np.uint32)
        self._n_cores = n_cores
        first = np.zeros(build.cores, dtype=np.uint32)
        first[:n_cores] = memory.first
        opened = self._library.softcore_open(pointer(first), build.cores)
        self._opened: ctypes.c_void_p | None = ctypes.c_void_p(opened)
        entries = np.ascontiguousarray(memory.entries())
        self._library.softcore_write(self._opened, pointer(entries), len(entries))
        # Unused cores have no compartments, whatever their memory holds at first.
        sizes = [[core, Select.SIZE, 0, 0, 0] for core in range(n_cores, build.cores)]
        unused = np.array(sizes, np.uint32)
        self._library.softcore_write(self._opened, pointer(unused), len(unused))
        for _ in range(2):  # clear both banks of sums
            self._step(np.zeros((0, 2), dtype=np.uint32), clear=True)
        self.state[:] = 0

    def step(self, messages: np.ndarray) -> CoreStep:
        """Take a step, with the host's messages, which arrive in the next step.

        Parameters
        ----------
        messages : (n, 2) int array
            Core and row.

        Raises
        ------
        BackendError
            If the step does not end.
        """
        return self._step(np.ascontiguousarray(messages, dtype=np.uint32), clear=False)

    def _step(self, messages: np.ndarray, clear: bool) -> CoreStep:
        cycles = self._library.softcore_step(
            self._opened,
            int(clear),
            pointer(messages),
            len(messages),
            pointer(self.state),
            pointer(self._counts),
            MOST_CYCLES,
        )
        if cycles < 0:
            raise BackendError(f"a step of the soft core did not end in {MOST_CYCLES:,} cycles")
        return CoreStep(cycles, self._counts[: self._n_cores].copy(), int(self._counts[-1]))

    def read(self, core: int, compartment: int) -> tuple[int, int, int]:
        """Return u, v and spike of a compartment of a core, through the chip's own port."""
        held = np.zeros(3, dtype=np.int32)
        self._library.softcore_read(self._opened, core, compartment, pointer(held))
        u, v, spike = held.tolist()
        return u, v, spike

    def close(self) -> None:
        """Free the simulation; it cannot step any more."""
        if self._opened is not None:
            self._library.softcore_close(self._opened)
            self._opened = None
