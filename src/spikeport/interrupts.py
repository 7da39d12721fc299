"""Child processes that a terminal's Ctrl-C does not reach: their parent ends them."""

import contextlib
import signal
from collections.abc import Iterator
from multiprocessing import resource_tracker


@contextlib.contextmanager
def uninterruptible() -> Iterator[None]:
    """Block SIGINT; processes that are started meanwhile inherit the block.

    Ctrl-C reaches child processes, too, and each would print a traceback. Their parent ends them.
    """
    resource_tracker.ensure_running()  # starting it later would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
