"""Keys of the terminal, where a process has one; a controller's are the remote's events."""

import os
import re
import select
import sys
import termios
import tty

from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.remote import TERMINAL

MOST_KEYS = 64
"""Keys that are taken at once."""

_BEGUN = r"(?:\[\[?|O)[0-?]*[!-/]*"
_SEQUENCE = re.compile(rf"\x1b(?:{_BEGUN}[@-Z\\-~]|[!-~])?")
"""The bytes of a key without a letter, as an arrow's ESC [ A, or of a letter with Alt.

None has a space, which is to stop a robot whatever came before it.
"""
_UNFINISHED = re.compile(rf"\x1b(?:{_BEGUN})?\Z")
"""The end of a text within a sequence."""


class Terminal:
    """The keys of a terminal, without waiting for any.

    Each counts as it is pressed, and is not echoed, until `close`.

    Parameters
    ----------
    descriptor : int or None
        The terminal's file; None for one that never has a key.
    """

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor
        self._unfinished = ""
        if descriptor is not None:
            self._before = termios.tcgetattr(descriptor)
            # Keys arrive one by one, and Ctrl-C still interrupts.
            tty.setcbreak(descriptor)
            _let_nothing_suspend(descriptor)

    @property
    def is_heard(self) -> bool:
        """True if keys can come from it."""
        return self._descriptor is not None

    def keys(self) -> str:
        """Return the letters that were pressed since the last call, as small ones.

        Arrows and function keys are none, though their sequences end in letters.
        """
        if self._descriptor is None or not select.select([self._descriptor], [], [], 0)[0]:
            return ""
        text = os.read(self._descriptor, MOST_KEYS).decode("ascii", "replace")
        # The rest of a sequence comes with the next call.
        whole, self._unfinished = _divided(self._unfinished + text)
        return _SEQUENCE.sub("", whole).lower()

    def events(self) -> list[Event]:
        """Return the events of the keys that were pressed since the last call."""
        return [TERMINAL[key] for key in self.keys() if key in TERMINAL]

    def close(self) -> None:
        """Let the terminal be as it was."""
        if self._descriptor is not None:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
            self._descriptor = None


def _divided(text: str) -> tuple[str, str]:
    """Return a text without, and with, the sequence that its end is within."""
    found = _UNFINISHED.search(text)
    end = len(text) if found is None else found.start()
    return text[:end], text[end:]


def _let_nothing_suspend(descriptor: int) -> None:
    r"""Let Ctrl-Z, Ctrl-\ and Ctrl-S be keys without a meaning.

    They would stop or end the process, or hold up what it prints, and leave a robot that it
    commands without damping.
    """
    found = termios.tcgetattr(descriptor)
    found[tty.IFLAG] &= ~termios.IXON
    for key in (termios.VSUSP, termios.VQUIT):
        found[tty.CC][key] = bytes([os.fpathconf(descriptor, "PC_VDISABLE")])
    termios.tcsetattr(descriptor, termios.TCSADRAIN, found)


def own_terminal() -> Terminal:
    """Return the terminal that is this process' input; without one, one that has no keys.

    A process in the background has none: the system would stop it as it asks for a key.
    """
    if sys.stdin is None or not sys.stdin.isatty():
        return Terminal(None)
    descriptor = sys.stdin.fileno()
    try:
        in_front = os.tcgetpgrp(descriptor) == os.getpgrp()
    except OSError:  # the terminal of another session
        in_front = False
    return Terminal(descriptor if in_front else None)
