"""Parameters of a board's Verilog, cut to a memory image."""

from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.writer import written
from tests.helpers.fake_board import small_image
from tests.helpers.soft_boards import pool
from tests.helpers.soft_images import wide_image


def test_parameters_are_cut_to_the_memory_image() -> None:
    assert parameters(written(small_image()), 6, pool()).splitlines() == [
        "`define CORES 2",
        "`define CORE 1",
        "`define LOG_COMPARTMENTS 5",
        "`define WIDTH 16",
        "`define LOG_QUEUE 9",
        "`define LOG_OUTPUTS 8",
        "`define WORDS {20'd1024, 20'd1024}",
        "`define AXONS {16'd512, 16'd512}",
    ]


def test_the_list_of_outputs_has_room_for_its_end() -> None:
    memory = written(small_image())
    for n, bits in ((255, 8), (256, 9), (511, 9), (512, 10)):
        assert f"`define LOG_OUTPUTS {bits}\n" in parameters(memory, n, pool())


def test_the_words_of_the_first_core_have_the_lowest_bits() -> None:
    memory = written(wide_image(1))
    assert (len(memory.cores[0].rows), len(memory.cores[1].rows)) == (3837, 4020)
    memory.cores[0].rows.resize(4097, refcheck=False)
    assert "`define WORDS {20'd4096, 20'd5120}\n" in parameters(memory, 30, pool())


def test_an_icebreakers_rows_lie_in_single_port_memories_and_its_queues_are_shorter() -> None:
    found = parameters(written(small_image()), 6, pool("softcore-up5k"))
    assert "`define LOG_QUEUE 8\n" in found
    assert "`define WORDS {20'd16384, 20'd16384}\n" in found
