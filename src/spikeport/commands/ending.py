"""The end of a command by a signal."""

import contextlib
import shlex
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import FrameType
from typing import NoReturn

from spikeport.build_timer import Ended

SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""A request to end, the end of the terminal, and Ctrl-\\."""
OF_SERVERS = (*SIGNALS, signal.SIGINT)
"""The signals that end a server: Ctrl-C leaves nothing of it incomplete."""


@contextlib.contextmanager
def ended_in_order(serves: bool = False) -> Iterator[None]:
    """Let signals end the command as an exit does, so that links and files are closed.

    Otherwise the process would end at once: a robot would not be damped, a stub not waited for.

    Parameters
    ----------
    serves : bool
        True for a server: Ctrl-C ends it, too, and its exit code is 0. Otherwise the code is 128
        plus the number of the signal, as in shells.
    """

    def end(number: int, _frame: FrameType | None) -> NoReturn:
        # A second signal does not interrupt the closing.
        signal.signal(number, signal.SIG_IGN)
        raise Ended(0 if serves else 128 + number)

    with _handled(OF_SERVERS if serves else SIGNALS, end):
        yield


@contextlib.contextmanager
def resumable(folder: Path, parts: str) -> Iterator[None]:
    """Tell the user, on an interrupt or SIGTERM, which parts are kept and how to resume."""
    # Not the end of the terminal: work of hours under `nohup` ignores it.
    with _handled((signal.SIGTERM,), signal.default_int_handler):
        try:
            yield
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"finished {parts} are kept in {folder}; to go on, give the same command with "
                f"--out {shlex.quote(str(folder))}"
            ) from None


@contextlib.contextmanager
def _handled(
    signals: Iterable[signal.Signals], handler: Callable[[int, FrameType | None], object]
) -> Iterator[None]:
    # Python lets the main thread alone handle signals.
    ours = threading.current_thread() is threading.main_thread()
    before = {one: signal.signal(one, handler) for one in _heard(signals)} if ours else {}
    try:
        yield
    finally:
        for one, earlier in before.items():
            signal.signal(one, earlier)


def _heard(signals: Iterable[signal.Signals]) -> list[signal.Signals]:
    """Return the signals, without SIGHUP if `nohup` has it ignored."""
    is_kept = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    return [one for one in signals if not (is_kept and one == signal.SIGHUP)]
