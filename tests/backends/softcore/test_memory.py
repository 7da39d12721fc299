"""The words of a memory image, as the host writes them."""

import numpy as np

from spikeport.backends.softcore.memory import Select, core_bits, wrapped
from spikeport.backends.softcore.writer import written
from tests.helpers.fake_board import small_image


def test_every_word_is_written_once_at_its_address() -> None:
    memory = written(small_image())
    entries = memory.entries()
    places = {tuple(entry[:3]) for entry in entries.tolist()}
    assert len(places) == len(entries)
    sizes = entries[entries[:, 1] == Select.SIZE]
    assert sizes[:, [0, 3]].tolist() == [[0, 3], [1, 2]]
    low, high = entries[(entries[:, 0] == 0) & (entries[:, 1] == Select.CONSTANTS)][0, 3:]
    assert (low & 0xFFFFFF, high >> 14) == (40, 1)  # its bias, and that it sends


def test_each_spike_of_the_host_sends_the_messages_of_its_source() -> None:
    memory = written(small_image())
    assert len(memory.messages(np.zeros(0, dtype=int))) == 0
    twice = memory.messages(np.array([2, 2]))
    assert twice.tolist() == [[0, 0]] * 2  # rows are equal, so one is stored
    assert len(memory.cores[0].rows) == 2 + 2


def test_the_number_of_a_core_has_as_many_bits_as_all_cores_need() -> None:
    assert [core_bits(n) for n in (1, 2, 3, 6, 8, 9)] == [1, 1, 2, 3, 3, 4]


def test_values_wrap_in_twos_complement() -> None:
    assert wrapped(np.array([127, 128, -129, 256]), 8).tolist() == [127, -128, 127, 0]
