"""Keys of a terminal are events, and the terminal is left as it was."""

import os
import pty
import termios

import pytest

from spikeport.robot.link import terminal
from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.terminal import Terminal


def test_keys_are_events_and_others_are_none() -> None:
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


def test_without_a_terminal_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal.sys, "stdin", None)
    keys = terminal.own_terminal()
    assert not keys.is_heard
    assert keys.events() == []
    keys.close()
