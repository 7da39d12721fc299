"""The soft core in Verilator: a library, built of its Verilog for a number of cores."""

import ctypes
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from spikeport import cache, hardware_models
from spikeport.backends.softcore.memory import LOG_COMPARTMENTS, ROW_BITS, SUM_BITS, core_bits
from spikeport.errors import BackendError, MissingExtraError

FOLDER = Path(hardware_models.__file__).parent / "softcore"
SIMULATION = FOLDER / "simulation.cpp"
PROGRAMS = ("verilator", "g++", "make")
BUILD_S = 300.0


class Build(NamedTuple):
    """The parameters of a chip that is built: cores, the unit of sums, and entries of queues."""

    cores: int
    unit: int = 0
    log_queue: int = 9

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
        return [f"-G{name}={value}" for name, value in parameters.items()]


def sources() -> list[Path]:
    """Return the files of Verilog that a chip is made of."""
    return sorted(FOLDER.glob("*.v"))


def require_verilator() -> None:
    """Look for what builds the core; MissingExtraError if a program is not installed."""
    for program in PROGRAMS:
        if shutil.which(program) is None:
            raise MissingExtraError(
                f"no {program} is installed here, which builds the soft core; "
                "install it with: apt-get install verilator g++ make"
            )


@functools.cache
def library(build: Build) -> ctypes.CDLL:
    """Return the library of a chip, from the user's cache or built anew (some 15 s).

    Raises
    ------
    MissingExtraError
        If Verilator, g++ or make is not installed.
    BackendError
        If it cannot be built; has the first line of the reason.
    """
    require_verilator()
    version = subprocess.run(["verilator", "--version"], capture_output=True, check=True).stdout
    files = {path.name: path.read_bytes() for path in [*sources(), SIMULATION]}
    # Everything that the library depends on: a change of the Verilog builds it anew.
    inputs = (version, files, tuple(build))
    kept = cache.of_user().kept("verilated", inputs, lambda: {"library": _built(build)})
    # A library is loaded from a file, which a process does not need any more once it has it.
    with tempfile.NamedTemporaryFile(suffix=".so") as file:
        file.write(kept["library"].tobytes())
        file.flush()
        return ctypes.CDLL(file.name)


def _built(build: Build) -> np.ndarray:
    """Return the bytes of a library."""
    with tempfile.TemporaryDirectory(prefix="spikeport-softcore-") as folder:
        options = ["--cc", "--exe", "--build", "-O3", "-Wno-WIDTH"]
        flags = ["-CFLAGS", "-fPIC -O2", "-LDFLAGS", "-shared", "--Mdir", folder]
        files = [*map(str, sources()), str(SIMULATION)]
        command = ["verilator", *options, *flags, "--top-module", "chip", *build.options, *files]
        command += ["-o", "softcore.so"]
        try:
            subprocess.run(command, capture_output=True, text=True, check=True, timeout=BUILD_S)
        except subprocess.CalledProcessError as error:
            first = next(iter(error.stderr.splitlines()), f"exit code {error.returncode}")
            raise BackendError(f"the soft core is not built: {first}") from None
        return np.fromfile(Path(folder) / "softcore.so", dtype=np.uint8)
