"""The design of a board: Verilog parameters that fit the cores to a memory image."""

from spikeport.backends.softcore.memory import LOG_COMPARTMENTS, MemoryImage
from spikeport.compile.image.manifest import SUM_BITS
from spikeport.compile.image.soft_rows import WORD_BITS
from spikeport.hardware_models.chip import SoftMemory


def parameters(memory: MemoryImage, n_outputs: int, pool: SoftMemory) -> str:
    """Return ``parameters.vh`` of ``board.v``: cores with memories as large as an image needs.

    Parameters
    ----------
    memory : MemoryImage
        The memory contents that the host writes.
    n_outputs : int
        Number of values and spikes that the host reads after each step.
    pool : SoftMemory
        The chip's memory, with the units in which rows and output axons grow, and its queues.
    """
    most = max(len(core.constants) for core in memory.cores)
    rows = [len(core.rows) for core in memory.cores]
    axons = [len(core.axons) for core in memory.cores]
    values = {
        "CORES": len(memory.cores),
        "CORE": memory.core_bits,
        # At least 5 bits: the 32 profiles are written by the same address.
        "LOG_COMPARTMENTS": min(max(5, (most - 1).bit_length()), LOG_COMPARTMENTS),
        "WIDTH": SUM_BITS - memory.unit,
        "LOG_QUEUE": (pool.queue.count - 1).bit_length(),
        # The end of the list takes an entry, too.
        "LOG_OUTPUTS": max(8, n_outputs.bit_length()),
        "WORDS": _vector(rows, pool.block.count // WORD_BITS, 20),
        "AXONS": _vector(axons, pool.axon_step.count, 16),
    }
    return "".join(f"`define {name} {value}\n" for name, value in values.items())


def _vector(sizes: list[int], step: int, bits: int) -> str:
    """Return sizes, rounded up, as a Verilog vector: the first core's in the lowest bits."""
    rounded = [f"{bits}'d{max(-(-size // step), 1) * step}" for size in reversed(sizes)]
    return "{" + ", ".join(rounded) + "}"
