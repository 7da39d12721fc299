"""The timer of a user's code: its notices, and the end of code that takes too long."""

import contextlib
import signal
import subprocess
import sys
import threading

import pytest

from spikeport import build_timer
from spikeport.build_timer import watched
from spikeport.errors import NetworkError


def test_code_that_ends_in_time_leaves_no_output_alarm_or_timer(capsys):
    before, threads = signal.getsignal(signal.SIGALRM), threading.active_count()
    with watched("net.py:make", limit_s=60):
        pass
    assert capsys.readouterr() == ("", "")
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    for timer in [one for one in threading.enumerate() if isinstance(one, threading.Timer)]:
        timer.join(20)
    assert threading.active_count() == threads


@pytest.mark.parametrize(
    ("limit_s", "cure"), [(None, "--build-timeout SECONDS ends it"), (60, "it has 60 s")]
)
def test_a_notice_names_code_that_takes_long_and_its_limit_or_a_cure(
    monkeypatch, capsys, limit_s, cure
):
    printed = threading.Event()
    monkeypatch.setattr(build_timer, "NOTICE_S", 0.0)
    monkeypatch.setattr(build_timer, "_say", lambda text: (print(text), printed.set()))
    with watched("net.py:make", limit_s):
        assert printed.wait(20)
    assert capsys.readouterr().out == f"net.py:make: has been building for 0 s; {cure}\n"


def stubborn():
    while True:
        with contextlib.suppress(Exception):
            sum(range(1000))


def test_code_that_catches_all_exceptions_is_ended():
    with pytest.raises(NetworkError) as caught, watched("net.py:make", limit_s=0.1):
        stubborn()
    assert str(caught.value) == (
        "net.py:make: did not return a network in 0.1 s, as --build-timeout asks"
    )


STUBBORN = """
from spikeport import build_timer
build_timer.GRACE_S = 0.1
with build_timer.watched("net.py:make", limit_s=0.1):
    while True:
        try:
            sum(range(1000))
        except BaseException:
            pass
"""


def test_the_process_ends_if_code_catches_even_base_exceptions():
    command = [sys.executable, "-c", STUBBORN]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "error: net.py:make: did not return a network in 0.1 s, as --build-timeout asks\n"
    )
