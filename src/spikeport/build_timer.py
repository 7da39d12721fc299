"""A timer for a user's code that builds a network: it reports slow code, and can end it."""

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from typing import NoReturn

from spikeport.errors import NetworkError
from spikeport.pacing import later

NOTICE_S = 10.0
"""Time after which a line names the code that takes so long."""
GRACE_S = 5.0
"""Time that code has after its limit to end, before the process is ended."""


class OutOfTime(BaseException):
    """The end of a user's code; not an Exception, since the code may catch Exceptions."""


class Ended(SystemExit):
    """The end of a command by a signal."""


FROM_OUTSIDE = (KeyboardInterrupt, OutOfTime, Ended)
"""The exceptions that end a user's code from outside."""


@contextlib.contextmanager
def watched(spec: str, limit_s: float | None = None) -> Iterator[None]:
    """Report code that takes more than `NOTICE_S` on standard error, and end it at its limit.

    The limit interrupts Python code of the main thread. Code that goes on for another `GRACE_S`,
    as in a library that does not return, ends the process with exit code 1.

    Raises
    ------
    NetworkError
        At the limit.
    """
    cure = "--build-timeout SECONDS ends it" if limit_s is None else f"it has {limit_s:g} s"
    with later(NOTICE_S, lambda: _say(f"{spec}: has been building for {NOTICE_S:g} s; {cure}")):
        if limit_s is None:
            yield
            return
        reason = f"{spec}: did not return a network in {limit_s:g} s, as --build-timeout asks"
        try:
            # The alarm is raised between two instructions of Python; C code that never returns to
            # Python ends with the process.
            with later(limit_s + GRACE_S, lambda: _end_process(reason)), _alarm(limit_s):
                yield
        except OutOfTime:
            raise NetworkError(reason) from None


@contextlib.contextmanager
def _alarm(limit_s: float) -> Iterator[None]:
    before = signal.signal(signal.SIGALRM, _interrupt)
    signal.setitimer(signal.ITIMER_REAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _interrupt(_number: int, _frame: object) -> NoReturn:
    raise OutOfTime


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _end_process(reason: str) -> NoReturn:
    _say(f"error: {reason}")
    # `sys.exit` would end the timer's thread alone.
    os._exit(NetworkError.exit_code)
