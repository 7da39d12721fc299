"""Signals that end a command as an exit does, so that everything open is closed."""

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
def test_a_signal_ends_a_command_as_an_exit_does(number: signal.Signals, serves: bool) -> None:
    closed = []

    def interrupted() -> None:
        with ended_in_order(serves):
            try:
                os.kill(os.getpid(), number)
            finally:
                os.kill(os.getpid(), number)  # a second signal does not interrupt the closing
                closed.append(True)

    with pytest.raises(SystemExit) as exits:
        interrupted()
    assert closed == [True]
    assert exits.value.code == (0 if serves else 128 + number)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_of_resumable_work_says_how_to_go_on(number: signal.Signals) -> None:
    with pytest.raises(KeyboardInterrupt) as interrupt, resumable(Path("my out"), "points"):
        os.kill(os.getpid(), number)
    assert str(interrupt.value) == (
        "finished points are kept in my out; to go on, give the same command with --out 'my out'"
    )


def test_handlers_of_signals_are_restored_after_the_command() -> None:
    before = [signal.getsignal(one) for one in SIGNALS]
    with ended_in_order():
        assert [signal.getsignal(one) for one in SIGNALS] != before
    assert [signal.getsignal(one) for one in SIGNALS] == before


def test_a_command_that_ignores_sighup_goes_on() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ended_in_order():
            os.kill(os.getpid(), signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)
