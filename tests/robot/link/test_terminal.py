"""Keys of a terminal as events, and the terminal's settings, which are restored."""

import os
import pty
import termios
import tty
from collections.abc import Iterator

import pytest

from spikeport.robot.link import terminal
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.terminal import Terminal


def test_only_known_keys_are_events_and_closing_restores_the_terminal() -> None:
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    keys = Terminal(theirs)
    assert keys.is_heard
    assert keys.events() == []
    os.write(ours, b"s?A\xff r")
    assert keys.events() == [Event.START, Event.RUN, Event.STOP, Event.REARM]
    assert keys.events() == []
    assert termios.tcgetattr(theirs) != before
    keys.close()
    assert termios.tcgetattr(theirs) == before
    keys.close()
    os.close(ours)
    os.close(theirs)


def test_a_terminal_whose_window_was_closed_is_left_without_an_error() -> None:
    ours, theirs = pty.openpty()
    keys = Terminal(theirs)
    os.close(ours)
    keys.close()
    assert not keys.is_heard
    os.close(theirs)


@pytest.fixture
def pressed() -> Iterator[tuple[int, Terminal]]:
    """Yield the end of a terminal that keys are written to, and its keys."""
    ours, theirs = pty.openpty()
    keys = Terminal(theirs)
    yield ours, keys
    keys.close()
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    "key",
    [
        *(b"\x1b[A", b"\x1bOA", b"\x1bOR", b"\x1bOS", b"\x1b[1;5A", b"\x1bO5A", b"\x1b[[A"),
        *(b"\x1b[3~", b"\x1b\x1b[A", b"\x1ba", b"\x1b"),
    ],
    ids=repr,
)
def test_arrows_function_keys_and_alt_are_not_read_as_letters(
    pressed: tuple[int, Terminal], key: bytes
) -> None:
    """The sequence of Up ends in the key for run, those of F3 and F4 in re-arm and start."""
    ours, keys = pressed
    os.write(ours, b"x" + key)
    assert keys.events() == []
    for at in range(1, len(key)):
        os.write(ours, b"x" + key[:at])
        assert keys.events() == []
        os.write(ours, key[at:] + b"x")
        assert keys.events() == []
    os.write(ours, b"xs")
    assert keys.events() == [Event.START]


@pytest.mark.parametrize("before", [b"\x1b", b"\x1b[", b"\x1b[1", b"\x1bO"], ids=repr)
def test_the_space_bar_stops_even_after_an_escape(
    pressed: tuple[int, Terminal], before: bytes
) -> None:
    ours, keys = pressed
    os.write(ours, before)
    assert keys.events() == []
    os.write(ours, b" ")
    assert keys.events() == [Event.STOP]


def test_only_ctrl_c_stops_the_process_and_no_key_stops_its_output() -> None:
    ours, theirs = pty.openpty()
    keys = Terminal(theirs)
    found = termios.tcgetattr(theirs)
    assert not found[tty.IFLAG] & termios.IXON
    assert [found[tty.CC][key] for key in (termios.VSUSP, termios.VQUIT)] == [b"\0", b"\0"]
    assert found[tty.CC][termios.VINTR] == b"\x03"
    keys.close()
    os.close(ours)
    os.close(theirs)


def test_without_a_terminal_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal.sys, "stdin", None)
    keys = terminal.own_terminal()
    assert not keys.is_heard
    assert keys.events() == []
    keys.close()
