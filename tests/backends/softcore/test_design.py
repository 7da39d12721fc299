"""Parameters of a board's Verilog, cut to a memory image."""

from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.writer import written
from tests.helpers.fake_board import small_image
from tests.helpers.soft_images import wide_image


def test_cores_are_cut_to_size() -> None:
    text = parameters(written(small_image()), baud_cycles=15)
    assert text.splitlines() == [
        "`define CORES 2",
        "`define CORE 1",
        "`define LOG_COMPARTMENTS 2",
        "`define WIDTH 16",
        "`define LOG_QUEUE 9",
        "`define BAUD_CYCLES 15",
        "`define WORDS {20'd1024, 20'd1024}",
        "`define AXONS {16'd512, 16'd512}",
    ]


def test_the_first_core_has_the_lowest_bits() -> None:
    memory = written(wide_image(1))
    assert (len(memory.cores[0].rows), len(memory.cores[1].rows)) == (3837, 4020)
    (words,) = [one for one in parameters(memory, 15).splitlines() if "WORDS" in one]
    assert words == "`define WORDS {20'd4096, 20'd4096}"
    (axons,) = [one for one in parameters(memory, 15).splitlines() if "AXONS" in one]
    assert [len(core.axons) for core in memory.cores] == [55, 64]
    assert axons == "`define AXONS {16'd512, 16'd512}"
