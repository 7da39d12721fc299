"""Bodies of frames, packed in the shorter form and unpacked, and refusals of other bodies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spikeport.backends.board.frame import MOST_BODY
from spikeport.backends.board.messages import BITMAP, BodyError, Codec
from spikeport.backends.step_log import MessageCounts, Totals
from spikeport.errors import BackendError
from tests.helpers.fake_board import small_image
from tests.helpers.images import Block, Output, Parts

CODEC = Codec(small_image())
WIDE = Codec(Parts(inputs=[300]).image())


@given(st.sets(st.integers(0, 299)), st.dictionaries(st.integers(0, 9), st.lists(st.floats())))
def test_a_step_is_unpacked_as_it_was_packed(
    spikes: set[int], errors: dict[int, list[float]]
) -> None:
    sent = {group: np.array(values) for group, values in errors.items()}
    body, flags = WIDE.pack_step(np.array(sorted(spikes), dtype=int), sent)
    got, got_errors = WIDE.unpack_step(body, flags)
    assert got.tolist() == sorted(spikes)
    assert bool(flags & BITMAP) == (4 * len(spikes) > 38)
    assert got_errors.keys() == sent.keys()
    for group, values in sent.items():
        np.testing.assert_array_equal(got_errors[group], values)


def test_a_step_that_no_frame_can_hold_is_refused_by_the_host() -> None:
    twice = np.zeros(MOST_BODY // 4 + 1, dtype=int)  # a list, of 4 bytes for each spike
    with pytest.raises(BackendError, match=rf"take [\d,]+ bytes a step, limit {MOST_BODY:,}"):
        CODEC.pack_step(twice, {})


def test_spikes_of_a_source_that_spikes_twice_are_sent_as_a_list() -> None:
    spikes = [*range(100), 7, 7]
    body, flags = WIDE.pack_step(np.array(spikes), {})
    assert not flags & BITMAP
    assert WIDE.unpack_step(body, flags)[0].tolist() == sorted(spikes)


@pytest.mark.parametrize(
    ("body", "flags", "reason"),
    [
        (b"", 0, "the step's body is cut: 0 bytes, fewer than its counts ask for"),
        (b"\4\0\0\0\0\0\5\0\0\0", 0, "sources must ascend from 0 to 4"),
        (b"\x08\0\0\0\0\0\2\0\0\0\1\0\0\0", 0, "sources must ascend from 0 to 4"),
        (b"\1\0\0\0\0\0\x04", BITMAP, "a bitmap of 1 bytes does not fit 5 sources"),
        (b"\2\0\0\0\0\0\0\0", BITMAP, "a bitmap of 2 bytes does not fit 5 sources"),
        (b"\0\0\0\0\1\0\0\0\0\0\3\0", 0, "cut: 12 bytes"),
        (b"\3\0\0\0\0\0\1\0\0", 0, "3 bytes of spikes, expected a multiple of 4"),
        (b"\0\0\0\0\0\0\0", 0, "has 7 bytes, but its counts give 6"),
        (b"\xff\xff\xff\xff\0\0", 0, "has 6 bytes, but its counts give 4294967301"),
    ],
)
def test_bodies_that_are_not_steps_are_refused(body: bytes, flags: int, reason: str) -> None:
    with pytest.raises(BodyError, match=reason):
        CODEC.unpack_step(body, flags)


@given(st.integers(-(2**31), 2**31 - 1), st.lists(st.booleans(), min_size=3, max_size=3))
def test_a_state_is_unpacked_as_it_was_packed(value: int, spiked: list[bool]) -> None:
    held = [np.array([value, 1]), np.array(spiked, dtype=int), np.array([-value - 1])]
    counts = np.arange(12).reshape(6, 2)
    got = CODEC.unpack_state(CODEC.pack_state(held, counts))
    for one, other in zip(got.held, held, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(got.counts, counts)


def test_a_state_of_another_size_is_refused() -> None:
    body = CODEC.pack_state(CODEC.silence(), np.zeros((6, 2), dtype=int))
    sizes = f"an answer of {len(body) - 1} bytes, expected {len(body)}"
    with pytest.raises(BodyError, match=sizes):
        CODEC.unpack_state(body[:-1])


def test_totals_are_unpacked_as_they_were_packed() -> None:
    between = np.array([[0, 3], [2**40, 0]])
    totals = Totals(MessageCounts(between, np.array([7, 8])), 9)
    got = CODEC.unpack_totals(CODEC.pack_totals(totals))
    np.testing.assert_array_equal(got.messages.between, between)
    np.testing.assert_array_equal(got.messages.from_host, [7, 8])
    assert got.readout_spikes == 9


def test_bodies_that_are_not_totals_are_refused() -> None:
    body = CODEC.pack_totals(Totals(MessageCounts(np.eye(2, dtype=int), np.zeros(2, int)), 0))
    with pytest.raises(BodyError, match=f"cut: {len(body) - 1} bytes"):
        CODEC.unpack_totals(body[:-1])
    with pytest.raises(BodyError, match="name a core above 1"):
        CODEC.unpack_totals(body[:-16] + b"\2" + body[-15:])


def test_outputs_that_do_not_fit_into_a_frame_are_refused() -> None:
    n = MOST_BODY // 4 // 1000
    parts = Parts(
        blocks=[Block(n=1000, core=core) for core in range(n)],
        outputs=[Output("voltage", list(range(1000 * n)))],
    )
    with pytest.raises(
        BackendError, match=r"outputs take 1,0\d\d,\d{3} bytes a step, limit 1,048,"
    ):
        Codec(parts.image())
