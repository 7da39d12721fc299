"""Layouts on the wire against cyclonedds' own serialisation, and Unitree's checksum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.robot.link.messages import LOW_CMD, LOW_STATE, SPORT_MODE_STATE, Struct
from spikeport.robot.link.wire import Layout, MessageError

MESSAGES = {struct.name: struct for struct in (LOW_CMD, LOW_STATE, SPORT_MODE_STATE)}
XCDR1 = bytes((0, 1, 0, 0))
LOW_CMD_WORDS = 202


def bitwise(words: np.ndarray) -> int:
    """Return Unitree's checksum of words, bit by bit as their `Crc32Core` has it."""
    crc = 0xFFFFFFFF
    for word in words.tolist():
        for bit in range(31, -1, -1):
            top = crc & 0x80000000
            crc = (crc << 1) & 0xFFFFFFFF
            if top:
                crc ^= 0x04C11DB7
            if word >> bit & 1:
                crc ^= 0x04C11DB7
    return crc


def c_struct(struct: Struct) -> np.dtype:
    """Return the C struct of a message, aligned by NumPy as C aligns it."""
    fields = []
    for name, kind, length in struct.fields:
        dtype = np.dtype(f"<{kind}") if isinstance(kind, str) else c_struct(kind)
        fields.append((name, dtype, (length,)) if length else (name, dtype))
    return np.dtype(fields, align=True)


def filled(struct: Struct, values: np.random.Generator) -> tuple[object, np.ndarray]:
    """Return a sample of cyclonedds and the C struct with the same random content."""
    from spikeport.robot.link.idl import idl_type

    def fill(sample: object, record: np.ndarray, of: Struct) -> None:
        for name, kind, length in of.fields:
            if isinstance(kind, Struct) and length:
                for number in range(length):
                    fill(getattr(sample, name)[number], record[name][number], kind)
            elif isinstance(kind, Struct):
                fill(getattr(sample, name), record[name], kind)
            else:
                drawn = np.frombuffer(values.bytes(4 * max(1, length)), f"<{kind}")
                drawn = np.where(np.isfinite(drawn), drawn, 1)[: max(1, length)].astype(kind)
                record[name] = drawn if length else drawn[0]
                setattr(sample, name, drawn.tolist() if length else drawn.tolist()[0])

    sample, record = idl_type(struct)(), np.zeros((), c_struct(struct))
    fill(sample, record, struct)
    return sample, record


@pytest.mark.parametrize("name", MESSAGES)
def test_layouts_match_cyclonedds_serialisation_and_unitrees_checksum(name: str) -> None:
    pytest.importorskip("cyclonedds")
    struct = MESSAGES[name]
    layout = Layout(struct)

    @settings(max_examples=20)
    @given(st.integers(0, 2**32 - 1))
    def holds(seed: int) -> None:
        sample, record = filled(struct, np.random.default_rng(seed))
        data = sample.serialize()
        assert data[:4] == XCDR1
        assert len(data) == 4 + layout.size
        for path, kind, length in struct.leaves():
            place = record
            for part in path.replace("[", ".").replace("]", "").split("."):
                place = place[int(part) if part.isdigit() else part]
            at, size = layout.at(path), length * np.dtype(kind).itemsize
            assert data[4 + at : 4 + at + size] == np.asarray(place).tobytes(), path
        if name != SPORT_MODE_STATE.name:
            words = np.frombuffer(record.tobytes(), "<u4")[:-1]
            assert layout.checksum(data[4:]) == bitwise(words)

    holds()


def test_sizes_of_messages_are_as_measured() -> None:
    sizes = {name: (Layout(s).size, Layout(s).size_in_c) for name, s in MESSAGES.items()}
    assert sizes == {
        "LowCmd_": (808, 812),
        "LowState_": (1176, 1180),
        "SportModeState_": (512, 516),
    }


def test_a_sealed_message_opens_and_a_spoilt_one_does_not() -> None:
    layout = Layout(LOW_CMD)
    words = np.arange(layout.size // 4, dtype="<u4")
    message = layout.sealed(words)
    np.testing.assert_array_equal(layout.opened(message)[0], words)
    for spoilt in (message[:-1], message + b"\0", b""):
        with pytest.raises(MessageError, match=r"LowCmd_: \d+ bytes, not 808"):
            layout.opened(spoilt)
    for at in (0, 25, 403, 807):
        flipped = bytearray(message)
        flipped[at] ^= 4
        with pytest.raises(MessageError, match="LowCmd_: its checksum is wrong"):
            layout.opened(bytes(flipped))


def test_a_field_of_single_bytes_has_no_words() -> None:
    with pytest.raises(AssertionError, match="head"):
        Layout(LOW_CMD).words("head")


def test_numbers_that_are_fewer_than_their_places_are_refused() -> None:
    words, places = np.zeros(LOW_CMD_WORDS, "<u4"), np.array([6, 7])
    with pytest.raises(ValueError, match="LowCmd_: 1 numbers for 2 places"):
        Layout(LOW_CMD).sealed(words, places, np.ones(1))


def test_padding_bytes_do_not_change_the_checksum() -> None:
    layout = Layout(LOW_CMD)
    message = bytearray(layout.sealed(np.zeros(LOW_CMD_WORDS, "<u4")))
    message[23] = 1  # between the first motor's mode and its q
    layout.opened(bytes(message))
