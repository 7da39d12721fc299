"""The design of a board: parameters of Verilog, by which cores are cut to a memory image."""

from spikeport.backends.softcore.memory import LOG_COMPARTMENTS, SUM_BITS, MemoryImage

WORDS_STEP, AXONS_STEP = 1024, 512
"""Entries that a block of memory of an FPGA holds."""


def parameters(memory: MemoryImage, baud_cycles: int, log_queue: int = 9) -> str:
    """Return ``parameters.vh`` of ``board.v``: cores with memories as large as an image needs.

    Parameters
    ----------
    memory : MemoryImage
        The contents.
    baud_cycles : int
        Clock cycles of a bit on the serial line.
    log_queue : int
        Messages that wait at a core: 2^log_queue.
    """
    most = max(len(core.constants) for core in memory.cores)
    values = {
        "CORES": len(memory.cores),
        "CORE": memory.core_bits,
        "LOG_COMPARTMENTS": min(max(1, (most - 1).bit_length()), LOG_COMPARTMENTS),
        "WIDTH": SUM_BITS - memory.unit,
        "LOG_QUEUE": log_queue,
        "BAUD_CYCLES": baud_cycles,
        "WORDS": _vector([len(core.rows) for core in memory.cores], WORDS_STEP, 20),
        "AXONS": _vector([len(core.axons) for core in memory.cores], AXONS_STEP, 16),
    }
    return "".join(f"`define {name} {value}\n" for name, value in values.items())


def _vector(sizes: list[int], step: int, bits: int) -> str:
    """Return sizes, rounded up, as a Verilog vector: the first core's in the lowest bits."""
    rounded = [f"{bits}'d{max(-(-size // step), 1) * step}" for size in reversed(sizes)]
    return "{" + ", ".join(rounded) + "}"
