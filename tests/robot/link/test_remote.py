import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.remote import KEYS, SIZE, TERMINAL, decode, pressed
from tests.helpers.standing_robot import remote

NO_KEYS = decode(remote())


@pytest.mark.parametrize(("bit", "key"), list(enumerate(KEYS)))
def test_a_key_is_a_bit_of_bytes_2_and_3(bit, key):
    message = bytearray(SIZE)
    message[2 + bit // 8] = 1 << bit % 8
    assert decode(bytes(message)) == {key}


@pytest.mark.parametrize("size", [0, 39, 41])
def test_a_message_of_another_size_is_refused(size):
    with pytest.raises(UsageError, match=f"{size} bytes, 40"):
        decode(bytes(size))


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


@pytest.mark.parametrize("first", ["L1", "R1"])
def test_a_pair_of_keys_is_an_event_only_once_both_are_down_in_any_order(first):
    one, both = decode(remote(first)), decode(remote("L1", "R1"))
    assert pressed(NO_KEYS, one) == []
    assert pressed(one, both) == [Event.REARM]


def test_stop_comes_last_and_so_wins():
    now = decode(remote("start", "A", "select", "L1", "R1"))
    assert pressed(NO_KEYS, now)[-1] is Event.STOP


def test_the_terminal_has_a_key_for_every_event_of_a_user():
    assert set(TERMINAL.values()) == {Event.START, Event.RUN, Event.STOP, Event.REARM}
