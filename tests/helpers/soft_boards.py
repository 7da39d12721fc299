"""Boards with soft cores in simulation, for an image."""

from spikeport.backends.softcore.chip import outputs_of
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.line import VerilatedLine
from spikeport.backends.softcore.verilated import BoardBuild
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import SoftMemory

BAUD_CYCLES = 15
FIFO = 0


def pool(chip: str = "softcore-ecp5-85f") -> SoftMemory:
    """Return the memory that the soft cores of a chip share."""
    found = chips.get(chip).soft_memory
    assert found is not None
    return found


def board_line(image: ChipImage, baud_cycles: int, baud_error: float = 0.0) -> VerilatedLine:
    """Return a line to a board for an image, with queues of four messages.

    With ``baud_cycles`` of 0 the line is a FIFO to USB.
    """
    memory, used = written(image), pool()
    short = used.model_copy(update={"queue": used.queue.model_copy(update={"value": 4})})
    n_outputs = sum(map(len, outputs_of(image)))
    build = BoardBuild(parameters(memory, n_outputs, short), baud_cycles)
    return VerilatedLine(build, baud_error=baud_error)
