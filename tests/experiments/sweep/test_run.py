"""Sweeps on Dask's workers, on loopback: what fails, what dies and what is not run again.

The points are made by functions defined in a fixture, which cloudpickle sends whole.
"""

import contextlib
import os
import signal
import time

import pytest
from distributed import LocalCluster

from spikeport.errors import BackendError, DivergedError, UsageError
from spikeport.experiments.sweep import run as sweep_run
from spikeport.experiments.sweep import workers as sweep_workers
from spikeport.experiments.sweep.folder import PointFiles, open_folder
from spikeport.progress import silent


@pytest.fixture
def faked(monkeypatch, tmp_path):
    """Points that take no robot: each leaves a mark, and then does what its `speed` says."""

    def run_point(point):
        marks = tmp_path / "marks"
        marks.mkdir(exist_ok=True)
        (marks / f"{point.name}-{len(list(marks.iterdir()))}").touch()
        deaths = len(list(marks.glob(f"{point.name}-*")))
        what = point.place["speed"]
        if what == "deadly" or (what == "dies once" and deaths == 1):
            time.sleep(0.5)  # Dask gives up a worker that dies before it is known to have started
            os.kill(os.getpid(), signal.SIGKILL)
        if what == "diverges":
            raise DivergedError("an action is not finite")
        return PointFiles({"metrics": {"threads": int(os.environ["OMP_NUM_THREADS"])}}, None)

    monkeypatch.setattr(sweep_run, "run_point", run_point)
    return lambda: sorted(path.name.split(",")[0] for path in (tmp_path / "marks").iterdir())


@pytest.fixture
def run(sweep_of, tmp_path):
    """Run a sweep over what its points do: its folder, and what failed."""

    def run(*speeds, scheduler=None, progress=silent):
        sweep = sweep_of(varied={"speed": speeds})
        folder = open_folder(tmp_path / "sweep", sweep)
        failures = sweep_run.run(sweep, folder, scheduler, 1, progress)
        return folder, {point.place["speed"]: reason for point, reason in failures}

    return run


@contextlib.contextmanager
def cluster(n_workers, threads):
    options = {
        "host": sweep_workers.LOCAL,
        "dashboard_address": None,
        "processes": False,
        "protocol": "tcp",
    }
    with LocalCluster(n_workers=n_workers, threads_per_worker=threads, **options) as started:
        yield started


@pytest.mark.slow
def test_a_worker_that_dies_costs_only_points_that_kill_it_again_and_again(run, faked):
    folder, failures = run("deadly", "dies once", "diverges", "walks")
    assert failures == {
        "deadly": "its worker died 3 times; cure: fewer --workers, if memory ran out",
        "diverges": "an action is not finite",
    }
    finished = sorted(path.name for path in folder.path.glob("points/*"))
    assert finished == ["speed=dies%20once,seed=0.json", "speed=walks,seed=0.json"]
    assert faked().count("speed=deadly") == 3
    assert faked().count("speed=dies%20once") == 2
    assert faked().count("speed=walks") == 1


@pytest.mark.slow
def test_what_is_finished_is_not_run_again(run, faked):
    def interrupt(what, _share):
        if what == "1 of 2 points":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("runs", "walks", progress=interrupt)
    shown = []
    _, failures = run("runs", "walks", progress=lambda what, share: shown.append((what, share)))
    assert failures == {}
    assert shown == [("starting the workers", None), ("1 of 2 points", 0.5)]
    assert faked().count("speed=runs") == 1
    shown.clear()
    run("runs", "walks", progress=lambda what, share: shown.append((what, share)))
    assert shown == []


@pytest.mark.slow
def test_a_point_has_one_thread(run, faked, sweep_of):
    folder, _ = run("walks")
    (point,) = sweep_of(varied={"speed": ("walks",)}).points()
    assert folder.read(point)["metrics"] == {"threads": 1}


def test_a_scheduler_runs_the_points(run, faked, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with cluster(n_workers=1, threads=1) as started:
        folder, failures = run("diverges", "walks", scheduler=started.scheduler_address)
    assert failures == {"diverges": "an action is not finite"}
    assert [path.name for path in folder.path.glob("points/*")] == ["speed=walks,seed=0.json"]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_told(run, monkeypatch, address):
    monkeypatch.setattr(sweep_workers, "ANSWER_S", 1)
    with pytest.raises(UsageError) as caught:
        run("walks", scheduler=address)
    assert str(caught.value) == (
        f"--scheduler {address}: no Dask scheduler answers within 1 s; start one with "
        "`dask scheduler`, or leave --scheduler out for processes on this machine"
    )


@pytest.mark.parametrize(
    ("n_workers", "threads", "found"),
    [(0, 1, "has no worker"), (1, 2, "has a worker of 2 threads")],
)
def test_a_scheduler_without_a_process_for_each_point_is_refused(
    run, monkeypatch, n_workers, threads, found
):
    monkeypatch.setattr(sweep_workers, "ANSWER_S", 1)
    with cluster(n_workers, threads) as started, pytest.raises(UsageError) as caught:
        run("walks", scheduler=(address := started.scheduler_address))
    assert str(caught.value) == (
        f"--scheduler {address}: {found}, but each point needs a process of its own; start workers "
        f"with `dask worker {address} --nthreads 1`"
    )


def test_a_sweep_without_workers_ends(run, faked, monkeypatch):
    monkeypatch.setattr(sweep_run, "PATIENCE_S", 1)
    with cluster(n_workers=1, threads=1) as started:

        def stop_workers(_what, share):
            if share is None:  # the workers are still being looked for
                return
            started.scale(0)
            until = time.monotonic() + 30
            while started.scheduler.workers and time.monotonic() < until:
                time.sleep(0.01)

        scheduler = started.scheduler_address
        with pytest.raises(BackendError) as caught:
            run("walks", scheduler=scheduler, progress=stop_workers)
    assert str(caught.value) == (
        "no worker is left, and none came back; cure: run the same command again, it goes on with "
        "what is not finished"
    )
