"""Boards with soft cores in simulation, for an image."""

from spikeport.backends.softcore.chip import outputs_of
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.line import VerilatedLine
from spikeport.backends.softcore.verilated import BoardBuild
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage

BAUD_CYCLES = 15
FIFO = 0


def board_build(image: ChipImage, baud_cycles: int, log_queue: int = 9) -> BoardBuild:
    """Return the board that an image is built for; ``baud_cycles`` of 0: with a FIFO to USB."""
    memory = written(image)
    n_outputs = sum(map(len, outputs_of(image, memory.order)))
    return BoardBuild(parameters(memory, n_outputs, log_queue), baud_cycles)


def board_line(image: ChipImage, baud_cycles: int, baud_error: float = 0.0) -> VerilatedLine:
    """Return a line to a board with queues of four messages."""
    return VerilatedLine(board_build(image, baud_cycles, log_queue=2), baud_error=baud_error)
