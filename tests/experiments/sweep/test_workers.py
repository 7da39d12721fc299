"""Processes that run points: nobody else reaches them, and they end with their parent."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread

import pytest

from spikeport.experiments.sweep import workers
from tests.helpers import sweeps
from tests.helpers.sockets import family, listening

START_S = 60
"""A busy machine may take so long to start a process."""


@pytest.fixture
def marks(monkeypatch, tmp_path):
    monkeypatch.setenv(sweeps.MARKS, str(tmp_path))
    return tmp_path


def wait_for(condition):
    until = time.monotonic() + START_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


def begun(marks):
    return list(marks.glob("speed=*"))


def test_the_helper_finds_listening_sockets(tmp_path):
    with socket.socket() as port, socket.socket(socket.AF_UNIX) as named:
        port.bind(("127.0.0.1", 0))
        named.bind(str(tmp_path / "socket"))
        assert listening([os.getpid()]) == []
        port.listen()
        named.listen()
        assert len(listening([os.getpid()])) == 2


@pytest.mark.slow
def test_a_sweep_opens_no_port_and_no_listening_socket(sweep_of, marks):
    points = sweep_of(varied={"speed": ("waits",)}, seeds=(0, 1)).points()
    others = listening(family(os.getpid()))  # other tests of this process may have left a socket
    with workers.outcomes(2, points, sweeps.do_as_told) as outcomes:
        ended = []
        thread = Thread(target=lambda: ended.extend(outcomes))
        thread.start()
        wait_for(lambda: len(begun(marks)) == 2)
        processes = family(os.getpid())
        assert len(processes) >= 3
        assert set(listening(processes)) <= set(others)
        (marks / "go on").touch()
        thread.join(START_S)
    assert len(ended) == 2


@pytest.mark.slow
def test_workers_end_with_the_block(sweep_of, marks):
    points = sweep_of(varied={"speed": ("walks", "waits")}).points()
    before = set(family(os.getpid()))
    with workers.outcomes(1, points, sweeps.do_as_told) as outcomes:
        assert next(outcomes)[0] == points[0]
        started = set(family(os.getpid())) - before
        assert started
    for process in started:
        assert not Path(f"/proc/{process}").exists()


PROGRAM = """
from spikeport.experiments.sweep import workers
from spikeport.experiments.sweep.plan import Sweep
from tests.helpers import sweeps

if __name__ == "__main__":
    sweep = Sweep("walk", "native", "loihi", None, 1.0, {}, {"speed": ("waits",)}, (0, 1))
    with workers.outcomes(2, sweep.points(), sweeps.do_as_told) as outcomes:
        list(outcomes)
"""


@pytest.mark.slow
def test_workers_end_when_their_parent_is_killed_and_the_next_sweep_cleans_up(
    sweep_of, marks, tmp_path, root, monkeypatch
):
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    (tmp_path / "program.py").write_text(PROGRAM)
    paths = os.pathsep.join(map(str, (root / "src", root)))
    environment = {**os.environ, "TMPDIR": str(temporary), "PYTHONPATH": paths}
    program = subprocess.Popen([sys.executable, tmp_path / "program.py"], env=environment)
    wait_for(lambda: len(begun(marks)) == 2)
    processes = family(program.pid)
    program.send_signal(signal.SIGKILL)
    program.wait()
    wait_for(lambda: not any(map(runs, processes)))
    (left,) = temporary.iterdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    points = sweep_of(varied={"speed": ("walks",)}).points()
    with workers.outcomes(1, points, sweeps.do_as_told) as outcomes:
        assert len(list(outcomes)) == 1
        assert not left.exists()
    assert list(temporary.iterdir()) == []


def runs(process):
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
