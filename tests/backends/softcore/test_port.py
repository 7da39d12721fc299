"""The bytes of a board's port."""

import binascii
from dataclasses import replace

import numpy as np
import pytest

from spikeport.backends.softcore import port
from spikeport.backends.softcore.memory import Select
from spikeport.backends.softcore.port import Held, Output, Target
from spikeport.backends.softcore.writer import written
from spikeport.errors import BackendError
from tests.helpers.fake_board import small_image

OUTPUTS = [
    Output(Held.U, 1, 2),
    Output(Held.V, 0, 0),
    *[Output(Held.SPIKE, 0, i) for i in range(9)],
]


def test_a_command_has_a_head_and_words_of_its_memory_s_width() -> None:
    sent = port.command(Select.ROWS, 5, np.array([0x1234, 0xABCD]), first=0x0102)
    assert sent == bytes.fromhex("02 05 0102 0002 1234 abcd")
    assert port.command(Select.CONSTANTS, 0, np.array([], dtype=int)) == b""
    assert {len(port.command(one, 0, np.zeros(1))) - 6 for one in Target} == {1, 3, 4}


def test_more_words_than_a_head_counts_are_two_commands() -> None:
    sent = port.command(Select.ROWS, 0, np.arange(1 << 16))
    assert len(sent) == 2 * (1 << 16) + 2 * 6
    assert sent[-8:] == bytes.fromhex("02 00 ffff 0001 ffff")


def test_loading_ends_with_the_list_of_outputs() -> None:
    sent = port.loading(written(small_image()), OUTPUTS[:3])
    assert sent.endswith(bytes.fromhex("07 00 0000 0004 02010002 03000000 01000000 00000000"))
    assert sent.startswith(bytes.fromhex("00 00 0000 0003"))


def test_a_step_is_sent_in_parts_that_fit_the_buffer_of_a_board() -> None:
    (one,) = port.stepping(np.array([[2, 0x1234]]))
    assert one == bytes.fromhex("09 00 0000 0001 00  08 00 0000 0001 021234") + port.ASK
    (cleared,) = port.stepping(np.zeros((0, 2), dtype=int), clear=True)
    assert cleared == bytes.fromhex("09 00 0000 0001 01") + port.ASK
    many = np.stack([np.full(400, 1), np.arange(400)], axis=1)
    parts = list(port.stepping(many))
    assert len(parts) == 3
    assert max(map(len, parts)) <= port.BUFFER_BYTES
    assert all(part.endswith(port.ASK) for part in parts)
    heads = 1 * 7 + 3 * (6 + len(port.ASK))
    assert sum(map(len, parts)) == heads + 3 * 400


def test_an_answer_is_read_in_the_list_s_order() -> None:
    content = bytes.fromhex("00000123 ffffff 000102 80 80")
    crc = binascii.crc_hqx(b"sent" + content, 0).to_bytes(2, "big")
    assert port.answer_bytes(OUTPUTS) == len(content + crc)
    cycles, values = port.answered(b"sent", content + crc, OUTPUTS)
    assert cycles == 0x123
    assert values.tolist() == [-1, 0x102, 1, 0, 0, 0, 0, 0, 0, 0, 1]


@pytest.mark.parametrize("place", range(14))
def test_a_wrong_bit_in_any_byte_of_an_answer_is_found(place: int) -> None:
    content = bytes.fromhex("00000123 ffffff 000102 80 80")
    received = bytearray(content + binascii.crc_hqx(b"sent" + content, 0).to_bytes(2, "big"))
    received[place] ^= 4
    with pytest.raises(BackendError, match="checksum is not that of the bytes sent and received"):
        port.answered(b"sent", bytes(received), OUTPUTS)


@pytest.mark.parametrize("n_bytes", [0, 1, 13, 15])
def test_an_answer_of_another_length_is_refused(n_bytes: int) -> None:
    content = bytes(max(n_bytes - 2, 0))
    received = (content + binascii.crc_hqx(content, 0).to_bytes(2, "big"))[:n_bytes]
    with pytest.raises(BackendError, match=f"answer has {n_bytes} bytes, and 14 belong"):
        port.answered(b"", received, OUTPUTS)


def test_loading_empties_the_cores_that_an_image_does_not_use() -> None:
    memory = replace(written(small_image()), core_bits=2)
    unused = range(len(memory.cores), 4)
    sent = port.loading(memory, OUTPUTS[:3])
    assert unused
    for number in unused:
        assert port.command(Select.SIZE, number, np.zeros(1, dtype=int)) in sent
