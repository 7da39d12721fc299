import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spikeport.errors import UsageError
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.remote import KEYS, SIZE, TERMINAL, decode, pressed
from tests.helpers.standing_robot import remote

NO_KEYS = decode(remote())


@pytest.mark.parametrize(("bit", "key"), list(enumerate(KEYS)))
def test_a_key_is_a_bit_of_bytes_2_and_3(bit, key):
    message = bytearray(SIZE)
    message[2 + bit // 8] = 1 << bit % 8
    assert decode(bytes(message)).keys == {key}


def test_sticks_are_where_unitree_has_them():
    message = bytearray(SIZE)
    for place, value in ((4, b"\x00\x00\x80\x3e"), (8, b"\x00\x00\x00\x3f")):  # 0.25, 0.5
        message[place : place + 4] = value
    for place, value in ((12, b"\x00\x00\x40\xbf"), (20, b"\x00\x00\x80\xbf")):  # -0.75, -1
        message[place : place + 4] = value
    found = decode(bytes(message))
    assert (found.left_x, found.right_x, found.right_y, found.left_y) == (0.25, 0.5, -0.75, -1.0)


@pytest.mark.parametrize("size", [0, 39, 41])
def test_a_message_of_another_size_is_refused(size):
    with pytest.raises(UsageError, match=f"{size} bytes, 40"):
        decode(bytes(size))


@given(st.binary(min_size=SIZE, max_size=SIZE))
def test_whatever_is_in_it_sticks_are_numbers_from_minus_1_to_1(message):
    _, *sticks = decode(message)
    assert all(math.isfinite(value) and abs(value) <= 1 for value in sticks)


@pytest.mark.parametrize(
    ("keys", "event"),
    [
        (("start",), Event.START),
        (("A",), Event.RUN),
        (("select",), Event.STOP),
        (("L1", "R1"), Event.REARM),
    ],
)
def test_keys_that_go_down_are_events(keys, event):
    now = decode(remote(*keys))
    assert pressed(NO_KEYS, now) == [event]
    assert pressed(now, now) == ([Event.STOP] if event is Event.STOP else [])
    assert pressed(now, NO_KEYS) == []


def test_one_of_two_keys_is_no_event_and_both_are_one_whichever_comes_first():
    one, both = decode(remote("L1")), decode(remote("L1", "R1"))
    assert pressed(NO_KEYS, one) == []
    assert pressed(one, both) == [Event.REARM]


def test_stop_comes_last_and_so_wins():
    now = decode(remote("start", "A", "select", "L1", "R1"))
    assert pressed(NO_KEYS, now)[-1] is Event.STOP


def test_the_terminal_has_a_key_for_every_event_of_a_user():
    assert set(TERMINAL.values()) == {Event.START, Event.RUN, Event.STOP, Event.REARM}
