"""Points on a Dask cluster, on loopback."""

import contextlib
import itertools
import shutil
import subprocess
import time
from types import SimpleNamespace

import dask
import pytest
from distributed import LocalCluster
from distributed.security import Security

from spikeport.errors import BackendError, UsageError
from spikeport.experiments.sweep import cluster as sweep_cluster
from spikeport.experiments.sweep import run as sweep_run
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.progress import silent
from tests.helpers import sweeps


@pytest.fixture
def run(sweep_of, tmp_path, monkeypatch):
    """Return a function that runs a sweep, and returns its folder and the reasons of failures."""
    (tmp_path / "marks").mkdir()
    monkeypatch.setenv(sweeps.MARKS, str(tmp_path / "marks"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")

    def run(*speeds, scheduler, progress=silent):
        sweep = sweep_of(varied={"speed": speeds})
        folder = SweepFolder(tmp_path / "sweep")
        failures = sweep_run.run(sweep.points(), sweeps.do_as_told, folder, scheduler, 1, progress)
        return folder, {point.place["speed"]: reason for point, reason in failures}

    return run


@contextlib.contextmanager
def cluster(n_workers, threads, **options):
    options = {"processes": False, "protocol": "tcp", **options}
    local = {"host": "127.0.0.1", "dashboard_address": None}
    with LocalCluster(
        n_workers=n_workers, threads_per_worker=threads, **local, **options
    ) as started:
        yield started


def test_a_scheduler_runs_the_points(run):
    with cluster(n_workers=1, threads=1) as started:
        folder, failures = run("diverges", "walks", scheduler=started.scheduler_address)
    assert failures == {"diverges": "an action is not finite"}
    assert [path.name for path in folder.path.glob("points/*")] == ["speed=walks,seed=0.json"]


@pytest.mark.slow  # the scheduler sets how often a worker may die
def test_only_points_that_keep_killing_their_worker_are_lost(run):
    with cluster(n_workers=1, threads=1, processes=True) as started:
        folder, failures = run("deadly", "dies once", scheduler=started.scheduler_address)
    assert failures == {
        "deadly": "its worker died 4 times; cure: fewer workers on a machine of the cluster, if "
        "memory ran out"
    }
    assert [path.name for path in folder.path.glob("points/*")] == ["speed=dies%20once,seed=0.json"]


@pytest.fixture
def certificates(tmp_path):
    """Return Dask's configuration with a self-signed certificate."""
    if shutil.which("openssl") is None:
        pytest.skip("needs openssl")
    key, certificate = (str(tmp_path / name) for name in ("key.pem", "certificate.pem"))
    new = ("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1")
    subject = ("-subj", "/CN=spikeport", "-keyout", key, "-out", certificate)
    subprocess.run([*new, *subject], check=True, capture_output=True)
    names = {"distributed.comm.tls.ca-file": certificate}
    for part in ("client", "scheduler", "worker"):
        names |= {f"distributed.comm.tls.{part}.key": key}
        names |= {f"distributed.comm.tls.{part}.cert": certificate}
    return names


@pytest.mark.slow
def test_a_scheduler_with_certificates_runs_points_only_for_a_holder_of_one(
    run, certificates, monkeypatch
):
    monkeypatch.setattr(sweep_cluster, "ANSWER_S", 2)
    with dask.config.set(certificates):
        secured = {"protocol": "tls", "security": Security(require_encryption=True)}
        with cluster(n_workers=1, threads=1, **secured) as started:
            address = started.scheduler_address
            assert address.startswith("tls://")
            assert run("walks", scheduler=address)[1] == {}
            none = dict.fromkeys(certificates)
            with dask.config.set(none), pytest.raises(UsageError) as error:
                run("walks", "runs", scheduler=address)
    assert str(error.value) == (
        f"--scheduler {address}: no Dask scheduler answers within 2 s with the certificates that "
        "Dask's configuration names (distributed.comm.tls); start one with `dask scheduler`, or "
        "leave --scheduler out for processes on this machine"
    )


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_reported(run, monkeypatch, address):
    monkeypatch.setattr(sweep_cluster, "ANSWER_S", 1)
    with pytest.raises(UsageError) as caught:
        run("walks", scheduler=address)
    assert str(caught.value) == (
        f"--scheduler {address}: no Dask scheduler answers within 1 s; start one with "
        "`dask scheduler`, or leave --scheduler out for processes on this machine"
    )


@pytest.mark.parametrize(
    ("n_workers", "threads", "found"),
    [(0, 1, "has no worker"), (1, 2, "has a worker with 2 threads")],
)
def test_a_scheduler_without_a_process_for_each_point_is_refused(
    run, monkeypatch, n_workers, threads, found
):
    monkeypatch.setattr(sweep_cluster, "ANSWER_S", 1)
    with cluster(n_workers, threads) as started, pytest.raises(UsageError) as caught:
        run("walks", scheduler=(address := started.scheduler_address))
    assert str(caught.value) == (
        f"--scheduler {address}: {found}, but each point needs a process of its own; start workers "
        f"with `dask worker {address} --nthreads 1`"
    )


def test_a_sweep_whose_workers_are_all_gone_ends_with_an_error(run, monkeypatch):
    monkeypatch.setattr(sweep_cluster, "PATIENCE_S", 1)
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
        "no worker is left, and none came back; cure: run the same command again: it continues "
        "with the unfinished points"
    )


@pytest.mark.parametrize(
    ("looks", "is_lost"), [([0] * 119 + [1] + [0] * 119, False), ([0] * 121, True)]
)
def test_workers_are_given_up_after_a_minute_without_any(monkeypatch, looks, is_lost):
    """A point that kills its worker again and again may take longer, but workers come back."""
    clock, seen = itertools.count(step=0.5), iter(looks)
    ended = SimpleNamespace(done={"future"})

    def wait(*_arguments, timeout, **_options):
        assert timeout == sweep_cluster.LOOK_S == 0.5
        nonlocal n_workers
        n_workers = next(seen, None)
        if n_workers is None:
            return ended
        raise TimeoutError

    n_workers = 1
    monkeypatch.setattr(sweep_cluster, "wait", wait)
    monkeypatch.setattr(sweep_cluster, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    client = SimpleNamespace(nthreads=lambda: {"worker": 1} if n_workers else {})
    if is_lost:
        with pytest.raises(BackendError, match="none came back"):
            sweep_cluster._ended(client, [])
    else:
        assert sweep_cluster._ended(client, []) == {"future"}
