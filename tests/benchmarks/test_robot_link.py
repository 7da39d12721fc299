"""A controller in a process of its own, and the end of one that fails."""

import contextlib
import multiprocessing
import os
import time
from types import SimpleNamespace

import pytest

robot_link = pytest.importorskip("robot_link", exc_type=ImportError)


@pytest.fixture(autouse=True)
def robot_left(monkeypatch):
    """Return an event that is set as the robot closes its bus, by which a controller ends."""
    event = multiprocessing.get_context("fork").Event()

    @contextlib.contextmanager
    def bus(*_args, **_options):
        yield
        event.set()

    monkeypatch.setattr(robot_link, "Bus", bus)
    return event


@pytest.fixture
def begun(monkeypatch):
    """Return the controller's process and the end of its pipe that is read."""
    found, fork, pipe = SimpleNamespace(), os.fork, os.pipe

    def recorded_fork():
        found.process = fork()
        return found.process

    def recorded_pipe():
        found.read, write = pipe()
        return found.read, write

    monkeypatch.setattr(os, "fork", recorded_fork)
    monkeypatch.setattr(os, "pipe", recorded_pipe)
    return found


def assert_ended(begun):
    """Check that the process is waited for, and its pipe closed."""
    with pytest.raises(ChildProcessError, match="No child processes"):
        os.waitpid(begun.process, os.WNOHANG)
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(begun.read)


def test_a_controller_that_fails_ends_the_robot_that_waits_for_it(monkeypatch, begun):
    def fails(_n, _pipe):
        raise RuntimeError("no domain")

    monkeypatch.setattr(robot_link, "controller", fails)
    with pytest.raises(ChildProcessError, match="the controller ended before the robot"):
        robot_link.with_controller(lambda _bus: time.sleep(60), 0)
    assert_ended(begun)


def test_a_robot_that_fails_ends_its_controller(monkeypatch, begun):
    def fails(_bus):
        raise RuntimeError("fell")

    monkeypatch.setattr(robot_link, "controller", lambda _n, _pipe: time.sleep(60))
    with pytest.raises(RuntimeError, match="fell"):
        robot_link.with_controller(fails, 0)
    assert_ended(begun)


def test_a_controller_without_a_result_is_an_error(monkeypatch, begun, robot_left):
    monkeypatch.setattr(robot_link, "controller", lambda _n, _pipe: robot_left.wait())
    with pytest.raises(ChildProcessError, match="ended without its result"):
        robot_link.with_controller(lambda _bus: None, 0)
    assert_ended(begun)


def test_the_result_of_a_controller_is_read_to_its_end(monkeypatch, begun, robot_left):
    times = [float(n) for n in range(20_000)]

    def controller(_n, pipe):
        robot_left.wait()
        with os.fdopen(pipe, "w") as written:
            written.write(f"[3, {times}]")

    monkeypatch.setattr(robot_link, "controller", controller)
    assert robot_link.with_controller(lambda _bus: "walked", 0) == ("walked", 3, times)
    assert_ended(begun)
