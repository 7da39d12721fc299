"""Processes that a terminal's Ctrl-C does not reach: the one that began them ends them."""

import contextlib
import signal
from collections.abc import Iterator
from multiprocessing import resource_tracker


@contextlib.contextmanager
def uninterruptible() -> Iterator[None]:
    """Block SIGINT; processes begun meanwhile keep it so.

    A terminal interrupts them too, which would say so at length; this process ends them.
    """
    resource_tracker.ensure_running()  # starting it later would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
