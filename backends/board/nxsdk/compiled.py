"""nengo-loihi's snips, compiled against spikeport's headers."""

import ctypes
import tempfile
from pathlib import Path

from spikeport.backends.board.nxsdk.package import Phase
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.extras import require_programs
from spikeport.programs import output_of

SNIPS = Path(__file__).with_name("snips")
GCC_S = 600.0
"""Time after which a compiler is given up; it takes a few seconds."""


def compiled(board: Board) -> ctypes.CDLL:
    """Compile a board's snips, and load them.

    Raises
    ------
    MissingExtraError
        If there is no gcc.
    BackendError
        If they do not compile; the message has the compiler's first line.
    """
    require_gcc()
    chip = next(s for s in board.snips if s["phase"] is Phase.EMBEDDED_MGMT)
    host = next(s for s in board.snips if s["phase"] is Phase.HOST_CONCURRENT_EXECUTION)
    with tempfile.TemporaryDirectory(prefix="spikeport-snips-") as folder:
        options = ["-O1", "-w", "-fPIC", f"-I{SNIPS}", f"-I{chip['includeDir']}"]
        snip, library = f"{folder}/chip.o", f"{folder}/board.so"
        # nengo-loihi's snip has `inline` functions without another definition
        _run("gcc", *options, "-fgnu89-inline", "-c", str(chip["cFilePath"]), "-o", snip)
        sources = [str(host["cppFile"]), str(SNIPS / "board.cpp"), snip]
        _run("g++", *options, "-shared", *sources, "-pthread", "-o", library)
        return ctypes.CDLL(library)


def require_gcc() -> None:
    """Look for the compilers of snips; MissingExtraError if one is not installed."""
    require_programs(("gcc", "g++"), "compiles nengo-loihi's snips", "g++")


def _run(*command: str) -> None:
    output_of(command, "nengo-loihi's snips do not compile", GCC_S)
