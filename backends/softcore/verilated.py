"""The soft core in Verilator: a library, built from its Verilog for a number of cores."""

import ctypes
import functools
import shutil
import tempfile
from collections.abc import Hashable
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from spikeport import cache, hardware_models
from spikeport.backends.softcore.memory import LOG_COMPARTMENTS, ROW_BITS, core_bits
from spikeport.compile.image.manifest import SUM_BITS
from spikeport.extras import require_programs
from spikeport.programs import output_of

FOLDER = Path(hardware_models.__file__).parent / "softcore"
PROGRAMS = ("verilator", "g++", "make")
NOT_BUILT = "the soft core is not built"
VERILATOR_S = 1800.0
"""Time after which a build is given up; it takes some 12 s, and longer on a busy machine."""
LOG_PATIENCE = 12
"""Cycles, 2^12, after which a board in simulation drops a command that is not whole."""


class Design(Hashable, Protocol):
    """Verilog, and the C++ around it, from which a library is built."""

    @property
    def top(self) -> str:
        """The name of the top module."""

    @property
    def files(self) -> list[Path]:
        """The Verilog and C++."""

    @property
    def options(self) -> list[str]:
        """The options of Verilator."""

    @property
    def include(self) -> dict[str, str]:
        """Texts of the files that the Verilog includes, by name."""


class Build(NamedTuple):
    """The parameters of a chip that is built: cores, the unit of sums, and entries of queues."""

    cores: int
    unit: int = 0
    log_queue: int = 9

    @property
    def top(self) -> str:
        """See `Design.top`."""
        return "chip"

    @property
    def files(self) -> list[Path]:
        """The chip's Verilog, and the C++ that steps it."""
        return [*sources(), FOLDER / "simulation.cpp"]

    @property
    def options(self) -> list[str]:
        """The parameters of ``chip.v``."""
        parameters = {
            "CORES": self.cores,
            "CORE": core_bits(self.cores),
            "ROW": ROW_BITS,
            "LOG_COMPARTMENTS": LOG_COMPARTMENTS,
            "WIDTH": SUM_BITS - self.unit,
            "LOG_QUEUE": self.log_queue,
        }
        return ["-DOBSERVED", *(f"-G{name}={value}" for name, value in parameters.items())]

    @property
    def include(self) -> dict[str, str]:
        """See `Design.include`."""
        return {}


class BoardBuild(NamedTuple):
    """The parameters of a board that is built.

    ``parameters`` is the text of ``parameters.vh``; ``baud_cycles`` the cycles of a bit on the
    serial line, 0 for a FIFO to USB.
    """

    parameters: str
    baud_cycles: int

    @property
    def top(self) -> str:
        """See `Design.top`."""
        return "board"

    @property
    def files(self) -> list[Path]:
        """The Verilog of chip and board, and the C++ that is the host's end of the link."""
        board = [FOLDER / "board" / f"{name}.v" for name in ("host", "uart", "fifo", "board")]
        return [*sources(), *board, FOLDER / "board" / "board.cpp"]

    @property
    def options(self) -> list[str]:
        """The parameters of ``board.v``."""
        is_fifo = self.baud_cycles == 0
        parameters = {
            "FIFO": int(is_fifo),
            "BAUD_CYCLES": 1 if is_fifo else self.baud_cycles,
            "LOG_PATIENCE": LOG_PATIENCE,
        }
        return [f"-G{name}={value}" for name, value in parameters.items()]

    @property
    def include(self) -> dict[str, str]:
        """The file of parameters."""
        return {"parameters.vh": self.parameters}


def sources() -> list[Path]:
    """Return the files of Verilog that a chip is made of."""
    return sorted(FOLDER.glob("*.v"))


def require_verilator() -> str:
    """Look for the programs that build the core, and return Verilator's version.

    Raises
    ------
    MissingExtraError
        If Verilator, g++ or make is not installed.
    BackendError
        If Verilator does not start.
    """
    require_programs(PROGRAMS, "builds the soft core", "verilator g++ make")
    return output_of(["verilator", "--version"], NOT_BUILT, VERILATOR_S)


@functools.cache
def library(build: Design) -> ctypes.CDLL:
    """Return the library of a chip or a board, from the user's cache or built anew (some 12 s).

    Raises
    ------
    MissingExtraError, BackendError
        See `require_verilator`; or if it cannot be built, with the first line of the reason.
    """
    version = require_verilator()
    files = {path.name: path.read_bytes() for path in build.files}
    # Everything that the library depends on: a change of the Verilog builds it anew.
    inputs = (version, files, build.options, build.include)
    kept = cache.of_user().kept("verilated", inputs, lambda: {"library": _built(build)})
    # A library is loaded from a file, which the process does not need afterwards.
    with tempfile.NamedTemporaryFile(suffix=".so") as file:
        file.write(kept["library"].tobytes())
        file.flush()
        return ctypes.CDLL(file.name)


def _built(build: Design) -> np.ndarray:
    """Return the bytes of a library."""
    with tempfile.TemporaryDirectory(prefix="spikeport-softcore-") as folder:
        for name, text in build.include.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        # In one folder, by their names alone: make does not know paths with spaces.
        for path in build.files:
            shutil.copy(path, folder)
        options = ["--cc", "--exe", "--build", "-O3", "-Wno-WIDTH"]
        # Its own runtime takes longer to optimise than to run.
        optimised = ["-MAKEFLAGS", "OPT_FAST=-O2 OPT_GLOBAL=-O0"]
        flags = ["-CFLAGS", "-fPIC", *optimised, "-LDFLAGS", "-shared", "--Mdir", "."]
        command = ["verilator", *options, *flags, "--top-module", build.top, *build.options]
        command += [*(path.name for path in build.files), "-o", "softcore.so"]
        output_of(command, NOT_BUILT, VERILATOR_S, folder)
        return np.fromfile(Path(folder) / "softcore.so", dtype=np.uint8)
