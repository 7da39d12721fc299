"""A signal ends a command as an exit does: what is open is closed, whatever it is."""

import os
import signal
from pathlib import Path

import pytest

from spikeport.commands.ending import OF_SERVERS, SIGNALS, ended_in_order, resumable


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(
    ("number", "serves"),
    [*((number, False) for number in SIGNALS), *((number, True) for number in OF_SERVERS)],
)
def test_a_signal_is_an_exit(number: signal.Signals, serves: bool) -> None:
    closed = []

    def interrupted() -> None:
        with ended_in_order(serves):
            try:
                os.kill(os.getpid(), number)
            finally:
                os.kill(os.getpid(), number)  # a second one does not interrupt what is closed
                closed.append(True)

    with pytest.raises(SystemExit) as exits:
        interrupted()
    assert closed == [True]
    assert exits.value.code == (0 if serves else 128 + number)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_can_be_resumed_says_how(number: signal.Signals) -> None:
    with pytest.raises(KeyboardInterrupt) as interrupt, resumable(Path("out"), "points"):
        os.kill(os.getpid(), number)
    assert str(interrupt.value) == (
        "finished points are kept in out; to go on, give the same command with --out out"
    )


def test_handlers_are_as_before_once_it_is_over() -> None:
    before = [signal.getsignal(one) for one in SIGNALS]
    with ended_in_order():
        assert [signal.getsignal(one) for one in SIGNALS] != before
    assert [signal.getsignal(one) for one in SIGNALS] == before


def test_what_ignores_the_end_of_its_terminal_goes_on() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ended_in_order():
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
