"""Sweeps in processes of this machine: failed points, dying workers and finished points."""

import sys

import pytest

from spikeport.errors import MissingExtraError
from spikeport.experiments.sweep import run as sweep_run
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.progress import silent
from tests.helpers import sweeps


@pytest.fixture
def marks(monkeypatch, tmp_path):
    """Return the folder in which points leave their marks."""
    folder = tmp_path / "marks"
    folder.mkdir()
    monkeypatch.setenv(sweeps.MARKS, str(folder))
    return folder


@pytest.fixture
def run(sweep_of, marks, tmp_path):
    """Return a function that runs a sweep, and returns its folder and the reasons of failures."""

    def run(*speeds, n_workers=1, progress=silent, **options):
        sweep = sweep_of(varied={"speed": speeds})
        folder = SweepFolder(tmp_path / "sweep")
        failures = sweep_run.run(
            sweep.points(), sweeps.do_as_told, folder, None, n_workers, progress, **options
        )
        return folder, {point.place["speed"]: reason for point, reason in failures}

    return run


@pytest.fixture
def begun(marks):
    """Return a function that counts how often a point was begun."""
    return lambda speed: len(list(marks.glob(f"speed={speed},*")))


@pytest.mark.slow
@pytest.mark.parametrize("n_workers", [1, 2])
def test_only_points_that_keep_killing_their_worker_are_lost(run, begun, n_workers):
    folder, failures = run("deadly", "dies once", "diverges", "walks", n_workers=n_workers)
    assert failures == {
        "deadly": "its worker died 3 times (SIGKILL); cure: fewer --workers, if memory ran out",
        "diverges": "an action is not finite",
    }
    finished = sorted(path.name for path in folder.path.glob("points/*"))
    assert finished == ["speed=dies%20once,seed=0.json", "speed=walks,seed=0.json"]
    assert (begun("deadly"), begun("dies%20once"), begun("walks")) == (3, 2, 1)


@pytest.mark.slow
def test_a_system_exit_of_a_point_is_distinguished_from_the_end_of_its_process(run):
    _, failures = run("exits", "ends")
    assert failures == {
        "exits": "SystemExit(3)",
        "ends": "its worker died 3 times (exit code 3); cure: fewer --workers, if memory ran out",
    }


@pytest.mark.slow
def test_finished_points_are_not_run_again(run, begun):
    def interrupt(what, _share):
        if what == "1 of 2 walks":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("runs", "walks", progress=interrupt, counted="walks")
    shown = []
    _, failures = run("runs", "walks", progress=lambda what, share: shown.append((what, share)))
    assert failures == {}
    assert shown == [
        ("starting the workers", None),
        ("1 of 2 points", 0.5),
        ("2 of 2 points", 1.0),
    ]
    assert begun("runs") == 1
    shown.clear()
    run("runs", "walks", progress=lambda what, share: shown.append((what, share)))
    assert shown == []


@pytest.mark.slow
def test_a_point_runs_with_one_thread(run, sweep_of):
    folder, _ = run("walks")
    (point,) = sweep_of(varied={"speed": ("walks",)}).points()
    assert folder.read(point)["metrics"] == {"threads": 1}


def test_a_cluster_without_dask_names_the_extra(sweep_of, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, sweep_run.CLUSTER, raising=False)
    points, folder = sweep_of().points(), SweepFolder(tmp_path)
    with pytest.raises(MissingExtraError) as error:
        sweep_run.run(points, sweeps.do_as_told, folder, "tls://host:8786", 1, silent)
    assert str(error.value) == (
        "--scheduler needs the package distributed, which is absent; "
        "install it with: pip install 'spikeport[sweep]'"
    )
