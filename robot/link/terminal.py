"""Keys of the terminal, where a process has one; a controller's are the remote's events."""

import os
import select
import sys
import termios
import tty

from spikeport.robot.link.controller_states import Event
from spikeport.robot.link.remote import TERMINAL

MOST_KEYS = 64
"""Keys that are taken at once."""


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
        if descriptor is not None:
            self._before = termios.tcgetattr(descriptor)
            # Keys arrive one by one, and Ctrl-C still interrupts.
            tty.setcbreak(descriptor)

    @property
    def is_heard(self) -> bool:
        """True if keys can come from it."""
        return self._descriptor is not None

    def keys(self) -> str:
        """Return the keys that were pressed since the last call, as small letters."""
        if self._descriptor is None or not select.select([self._descriptor], [], [], 0)[0]:
            return ""
        return os.read(self._descriptor, MOST_KEYS).decode("ascii", "replace").lower()

    def events(self) -> list[Event]:
        """Return the events of the keys that were pressed since the last call."""
        return [TERMINAL[key] for key in self.keys() if key in TERMINAL]

    def close(self) -> None:
        """Let the terminal be as it was."""
        if self._descriptor is not None:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
            self._descriptor = None


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
