"""Keys of a process' terminal, if it has one; for a controller, they are events of the remote."""

import contextlib
import os
import re
import select
import sys
import termios
import tty

from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.remote import TERMINAL

MOST_KEYS = 64
"""The most keys that are read at once."""

_BEGUN = r"(?:\[\[?|O)[0-?]*[!-/]*"
_SEQUENCE = re.compile(rf"\x1b(?:{_BEGUN}[@-Z\\-~]|[!-~])?")
"""The bytes of a key without a letter, such as an arrow's ESC [ A, or of a letter with Alt.

No sequence contains a space, as a space must stop a robot whatever came before it.
"""
_UNFINISHED = re.compile(rf"\x1b(?:{_BEGUN})?\Z")
"""An unfinished sequence at the end of a text."""


class Terminal:
    """The keys of a terminal, read without waiting.

    Until `close`, keys come one by one as they are pressed, and are not echoed.

    Parameters
    ----------
    descriptor : int or None
        The terminal's file descriptor; None for a terminal that never has a key.
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
        """True if keys can come from the terminal."""
        return self._descriptor is not None

    def keys(self) -> str:
        """Return the letters that were pressed since the last call, in lower case.

        Arrows and function keys do not count, though their sequences end in letters.
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
        """Restore the terminal's settings."""
        if self._descriptor is not None:
            descriptor, self._descriptor = self._descriptor, None
            with contextlib.suppress(termios.error):  # its window was closed
                termios.tcsetattr(descriptor, termios.TCSADRAIN, self._before)


def _divided(text: str) -> tuple[str, str]:
    """Return a text without the unfinished sequence at its end, and that sequence."""
    found = _UNFINISHED.search(text)
    end = len(text) if found is None else found.start()
    return text[:end], text[end:]


def _let_nothing_suspend(descriptor: int) -> None:
    r"""Turn off the meaning of Ctrl-Z, Ctrl-\ and Ctrl-S.

    They would stop or end the process, or block its output, and leave a robot that it commands
    without damping.
    """
    found = termios.tcgetattr(descriptor)
    found[tty.IFLAG] &= ~termios.IXON
    for key in (termios.VSUSP, termios.VQUIT):
        found[tty.CC][key] = bytes([os.fpathconf(descriptor, "PC_VDISABLE")])
    termios.tcsetattr(descriptor, termios.TCSADRAIN, found)


def own_terminal() -> Terminal:
    """Return the terminal that is this process' input; without one, a terminal without keys.

    A background process gets no keys: the system would stop the process as it reads one.
    """
    if sys.stdin is None or not sys.stdin.isatty():
        return Terminal(None)
    descriptor = sys.stdin.fileno()
    try:
        in_front = os.tcgetpgrp(descriptor) == os.getpgrp()
    except OSError:  # the terminal of another session
        in_front = False
    return Terminal(descriptor if in_front else None)
