"""Frames in a stream of bytes that may be cut or spoilt."""

import random
import zlib

from hypothesis import given
from hypothesis import strategies as st

from spikeport.backends.board.frame import HEAD, MOST_BODY, VERSION, Frame, Kind, Splitter

frames = st.builds(
    Frame,
    kind=st.sampled_from(Kind),
    session=st.integers(0, 2**32 - 1),
    step=st.integers(0, 2**64 - 1),
    body=st.binary(max_size=60),
    flags=st.integers(0, 2**16 - 1),
    lasted_us=st.integers(0, 2**32 - 1),
    version=st.just(VERSION),
)


def split(splitter: Splitter, data: bytes, size: int) -> list[Frame]:
    found = []
    for start in range(0, len(data), size):
        splitter.feed(data[start : start + size])
        while (frame := splitter.next()) is not None:
            found.append(frame)
    return found


@given(st.lists(frames, max_size=5), st.integers(1, 50))
def test_frames_survive_a_stream_cut_anywhere(sent: list[Frame], size: int) -> None:
    splitter = Splitter()
    assert split(splitter, b"".join(frame.encode() for frame in sent), size) == sent
    assert splitter.bad == 0


@given(frames, st.binary(max_size=100), frames, st.integers(1, 50))
def test_bytes_between_frames_are_skipped(
    first: Frame, rubbish: bytes, second: Frame, size: int
) -> None:
    data = first.encode() + rubbish.replace(b"S", b"s") + second.encode()
    assert split(Splitter(), data, size) == [first, second]


@given(frames, frames, st.randoms(use_true_random=False))
def test_a_flipped_bit_costs_one_frame(first: Frame, second: Frame, rng: random.Random) -> None:
    data = bytearray(first.encode())
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    splitter = Splitter()
    assert split(splitter, bytes(data) + second.encode(), 64) == [second]
    assert splitter.bad >= 1


def test_a_length_beyond_the_limit_is_not_waited_for() -> None:
    data = bytearray(Frame(Kind.STATE, body=b"abc").encode())
    data[28:32] = (MOST_BODY + 1).to_bytes(4, "little")
    data[36:40] = zlib.crc32(data[:36]).to_bytes(4, "little")
    following = Frame(Kind.STATE, step=2)
    assert split(Splitter(), bytes(data) + following.encode(), 1000) == [following]


def test_the_layout_is_that_of_the_documentation() -> None:
    data = Frame(Kind.STATE, 0x01020304, 5, b"xy", flags=6, lasted_us=7).encode()
    assert HEAD.size == 36
    assert data[:8] == b"SPKL\x01\x06\x06\x00"
    assert data[8:20] == b"\x04\x03\x02\x01" + b"\x05" + bytes(7)
    assert data[28:36] == b"\x02\0\0\0" + b"\x07\0\0\0"
    assert data[36:40] == zlib.crc32(data[:36]).to_bytes(4, "little")
    assert data[40:] == b"xy" + zlib.crc32(b"xy").to_bytes(4, "little")
