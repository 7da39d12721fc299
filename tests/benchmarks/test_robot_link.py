"""A controller in a process of its own, and the end of one that fails."""

import contextlib
import os
import time

import pytest

robot_link = pytest.importorskip("robot_link", exc_type=ImportError)


@pytest.fixture(autouse=True)
def _no_bus(monkeypatch):
    monkeypatch.setattr(robot_link, "Bus", lambda *_args, **_options: contextlib.nullcontext())


def test_a_controller_that_fails_ends_the_robot_that_waits_for_it(monkeypatch):
    def fails(_n, _pipe):
        raise RuntimeError("no domain")

    monkeypatch.setattr(robot_link, "controller", fails)
    with pytest.raises(ChildProcessError, match="the controller ended before the robot"):
        robot_link.with_controller(lambda _bus: time.sleep(60), 0)


def test_a_controller_without_a_result_is_an_error(monkeypatch):
    monkeypatch.setattr(robot_link, "controller", lambda _n, _pipe: time.sleep(0.5))
    with pytest.raises(ChildProcessError, match="ended without its result"):
        robot_link.with_controller(lambda _bus: None, 0)


def test_the_result_of_a_controller_is_read_to_its_end(monkeypatch):
    times = [float(n) for n in range(20_000)]

    def controller(_n, pipe):
        time.sleep(0.5)
        with os.fdopen(pipe, "w") as written:
            written.write(f"[3, {times}]")

    monkeypatch.setattr(robot_link, "controller", controller)
    assert robot_link.with_controller(lambda _bus: "walked", 0) == ("walked", 3, times)
