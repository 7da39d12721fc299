"""``spikeport sweep`` from the command line; its workers are tested in tests/experiments."""

import json
import os
import signal
import sys
import time

import pytest
import xarray as xr

from spikeport.cache import own_version
from spikeport.experiments.sweep import run as sweep_run
from spikeport.experiments.sweep.plan import computing_versions
from spikeport.experiments.sweep.run import Failure
from tests.helpers.sweeps import finish, write_path

REACH = ("sweep", "reach", "--backend", "reference", "--seconds", "0.02")
EXACT_REACH = ("sweep", "reach", "--backend", "analytic", "--seconds", "0.02")
FILES = "figure.png, points, sweep.json, table.nc"
START_S = 120
"""Time in s that a busy machine may take to finish a point."""


@pytest.fixture
def counted(monkeypatch):
    """Run points whose ``reaches`` are their size, without work; points of size 30 fail."""

    def run(points, _run_point, folder, _scheduler, _n_workers, _progress, _counted):
        for point in points:
            if point.place["m1"] != 30:
                finish(folder, point, reaches=point.place["m1"])
        missing = [point for point in points if not folder.holds(point)]
        return [Failure(point, "too small") for point in missing]

    monkeypatch.setattr(sweep_run, "run", run)


@pytest.fixture
def counted_walks(monkeypatch):
    """Run walks whose metric is their seed, without work."""

    def run(points, _run_point, folder, _scheduler, _n_workers, _progress, _counted):
        for point in points:
            finish(folder, point, falls=point.place["seed"])
        return []

    monkeypatch.setattr(sweep_run, "run", run)


def test_a_sweep_leaves_points_table_and_figure(spikeport, counted, tmp_path):
    done = spikeport(*REACH, "--vary", "m1=10,20", "--seeds", 2, "--out", tmp_path)
    assert done == (0, f"4 of 4 points finished\nwritten: {tmp_path}/ ({FILES})\n", "")
    with xr.open_dataset(tmp_path / "table.nc", engine="h5netcdf") as table:
        assert table.reaches.values.tolist() == [[10, 10], [20, 20]]
    assert json.loads((tmp_path / "sweep.json").read_text()) == {
        "experiment": "reach",
        "backend": "reference",
        "chip": "loihi",
        "pipeline": None,
        "seconds": 0.02,
        "settings": {},
        "varied": {"m1": [10, 20]},
        "seeds": [0, 1],
        "probes": False,
        "files": {},
        "spikeport": own_version(),
        "versions": computing_versions(),
    }


def test_a_sweep_keeps_time_series_if_asked_to(spikeport, counted, tmp_path):
    assert spikeport(*REACH, "--vary", "m1=10", "--probes", "--out", tmp_path).code == 0
    assert json.loads((tmp_path / "sweep.json").read_text())["probes"]


def test_a_setting_that_no_point_needs_is_refused(spikeport, tmp_path):
    walk = ("sweep", "walk", "--backend", "analytic", "--seconds", "4", "--out", tmp_path / "out")
    done = spikeport(*walk, "--vary", "push_every=1,2")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: push_every: does nothing without push, which is 0; cure: ")
    assert not (tmp_path / "out").exists()


def test_sizes_of_neurons_are_refused_if_no_point_has_neurons(spikeport, counted, tmp_path):
    done = spikeport(*EXACT_REACH, "--vary", "m1=10,20", "--out", tmp_path / "out")
    assert done == (
        2,
        "",
        "error: m1: does nothing on backend 'analytic', which has no neurons; cure: --backend "
        "native, or leave it out\n",
    )
    both = (*EXACT_REACH[:2], "--seconds", "1", "--vary", "backend=reference,analytic")
    assert spikeport(*both, "--vary", "m1=10", "--out", tmp_path / "out").code == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "values"),
    [
        ("small,large", ["small", "large"]),
        ("small;0.2:0.4,-0.3:-0.1,1.1:1.3", ["small", "0.2:0.4,-0.3:-0.1,1.1:1.3"]),
        ("0.2:0.4,-0.3:-0.1,1.1:1.3;", ["0.2:0.4,-0.3:-0.1,1.1:1.3"]),
    ],
)
def test_values_with_commas_are_separated_by_semicolons(
    spikeport, counted, tmp_path, typed, values
):
    vary = ("--vary", f"box={typed}", "--vary", "m1=10")
    assert spikeport(*REACH, *vary, "--out", tmp_path).code == 0
    varied = json.loads((tmp_path / "sweep.json").read_text())["varied"]
    assert varied == {"box": values, "m1": [10]}


def test_a_sweep_of_too_many_points_is_refused(spikeport, counted, tmp_path):
    values = ",".join(map(str, range(10, 1010)))
    done = spikeport(*REACH, "--vary", f"m1={values}", "--seeds", 101, "--out", tmp_path / "out")
    assert done == (
        2,
        "",
        "error: a sweep of 101,000 points, limit 100,000; cure: fewer values of --vary, or fewer "
        "--seeds\n",
    )
    assert spikeport(*REACH, "--seeds", 10**11, "--out", tmp_path / "out").code == 2
    assert not (tmp_path / "out").exists()


def test_a_point_that_failed_is_reported(spikeport, counted, tmp_path):
    done = spikeport(*REACH, "--vary", "m1=10,30", "--out", tmp_path)
    assert done == (
        1,
        "failed: m1=30,seed=0: too small\n1 of 2 points finished\n"
        f"written: {tmp_path}/ ({FILES})\n",
        "",
    )


def test_a_sweep_without_a_finished_point_writes_no_table_or_figure(spikeport, counted, tmp_path):
    done = spikeport(*REACH, "--vary", "m1=30", "--out", tmp_path)
    assert (done.code, done.err) == (1, "")
    assert done.out.endswith(f"0 of 1 points finished\nwritten: {tmp_path}/ (sweep.json)\n")


def test_the_error_of_a_missing_package_names_the_extra(spikeport, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "xarray", None)
    monkeypatch.delitem(sys.modules, "spikeport.experiments.sweep.table", raising=False)
    done = spikeport(*REACH, "--vary", "m1=10", "--out", tmp_path / "out")
    assert done == (
        2,
        "",
        "error: a sweep needs the package xarray, which is absent; "
        "install it with: pip install 'spikeport[robot]'\n",
    )


def test_workers_are_refused_for_a_cluster(spikeport, counted, tmp_path):
    out = tmp_path / "out"
    where = ("--scheduler", "tls://10.0.0.1:8786", "--workers", 4)
    assert spikeport(*REACH, *where, "--out", out) == (
        2,
        "",
        "error: --workers 4: a cluster has workers of its own; leave it out, or leave --scheduler "
        "out\n",
    )
    assert not out.exists()


KEYS = "appearance, box, calibrated, cb, efference_copy, m1, network_seed, preset, s1"
BACKENDS = "analytic, board, native, native-threads, nengo-loihi, reference"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--vary", "m1"), "--vary m1: expected KEY=VALUE,VALUE,..."),
        (("--vary", "m2=1"), f"unknown key of experiment 'reach' 'm2'; choose from: {KEYS}"),
        (("--vary", "m1=10,x"), "--vary m1=x: expected a whole number"),
        (("--vary", "m1=10,0"), "m1=0: the number of neurons must be at least 1"),
        (("--vary", "m1=10,10"), "--vary m1=10,10: a value is given twice"),
        (("--vary", "m1=10", "--vary", "m1=20"), "--vary m1: given twice"),
        (("--vary", "m1=10", "--set", "m1=20"), "--vary m1: also given with --set; choose one"),
        (
            ("--vary", "backend=native,brd"),
            f"unknown backend of reach 'brd'; choose from: {BACKENDS}",
        ),
        (("--backend", "replay"), "backend replay: a record is of one run, not of a sweep"),
        (
            ("--vary", "backend=native,replay"),
            "backend replay: a record is of one run, not of a sweep",
        ),
        (("--backend", "brd"), f"unknown backend of reach 'brd'; choose from: {BACKENDS}"),
        (
            ("--vary", "backend=native,analytic"),
            "--vary backend: also given with --backend; choose one",
        ),
        (("--set", "m1=x"), "--set m1=x: expected a whole number"),
        (
            ("--backend", "analytic", "--passes", "compact"),
            "--passes: for backend 'analytic' nothing is compiled; leave it out, or choose "
            "--backend native",
        ),
        (
            ("--seconds", "0"),
            "--seconds 0: reach simulates at least 0.005 s, and at most 1,000,000,000 steps of "
            "0.001 s",
        ),
    ],
)
def test_wrong_options_are_refused_before_anything_starts(spikeport, tmp_path, options, message):
    out = tmp_path / "out"
    done = spikeport(*REACH, "--out", out, *options)
    assert done == (2, "", f"error: {message}\n")
    assert not out.exists()


def test_a_path_that_cannot_be_followed_is_refused_before_anything_starts(spikeport, tmp_path):
    out = tmp_path / "out"
    done = spikeport("sweep", "walk", "--vary", "path=line,circle", "--out", out)
    known = "FILE.csv, figure-eight, line, loop, s-curve"
    assert done == (2, "", f"error: unknown path 'circle'; choose from: {known}\n")
    assert not out.exists()


WALK = ("sweep", "walk", "--backend", "analytic", "--seconds", "2")


@pytest.mark.parametrize("option", [("--set", "path={}"), ("--vary", "path=line,{}")])
def test_a_sweep_does_not_go_on_with_another_path_in_its_file(
    spikeport, counted_walks, tmp_path, option
):
    path, out = tmp_path / "path.csv", tmp_path / "out"
    command = (*WALK, option[0], option[1].format(path), "--seeds", 2, "--out", out)
    write_path(path, speed_m_s=0.3)
    assert spikeport(*command).code == 0
    write_path(path, speed_m_s=0.2)
    done = spikeport(*command)
    assert (done.code, done.out) == (2, "")
    assert f"{out}: was begun with other contents of {path} (digest " in done.err
    assert "put the file back as it was, or choose another --out" in done.err
    write_path(path, speed_m_s=0.3)
    assert spikeport(*command).code == 0


def test_a_file_that_is_not_there_is_named_before_anything_starts(spikeport, tmp_path):
    out, file = tmp_path / "out", tmp_path / "none.npz"
    done = spikeport("sweep", "reach", "--set", f"calibrated={file}", "--out", out)
    cure = "cure: one of true, false, or the path of a file"
    assert done == (2, "", f"error: calibrated={file}: no such file; {cure}\n")
    assert not out.exists()


@pytest.mark.slow
def test_a_worker_refuses_a_path_that_changes_while_the_sweep_runs(
    spikeport, monkeypatch, tmp_path
):
    path, out = tmp_path / "path.csv", tmp_path / "out"
    write_path(path, speed_m_s=0.3)
    whole = sweep_run.run

    def run(*arguments):
        write_path(path, speed_m_s=0.2)
        return whole(*arguments)

    monkeypatch.setattr(sweep_run, "run", run)
    done = spikeport(*WALK, "--set", f"path={path}", "--out", out, "--workers", 1)
    assert done.code == 1
    assert f"failed: seed=0: {path}: changed since the sweep began (digest " in done.out
    assert not (out / "points").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_an_interrupted_sweep_resumes_with_the_missing_points(
    spikeport, start, without_stages, tmp_path
):
    command = (*EXACT_REACH, "--vary", "network_seed=1,2,3", "--out", tmp_path, "--workers", "1")
    interrupted = start(*command, start_new_session=True)
    first = tmp_path / "points" / "network_seed=1,seed=0.json"
    until = time.monotonic() + START_S
    while not first.exists() and time.monotonic() < until:
        time.sleep(0.05)
    os.killpg(interrupted.pid, signal.SIGINT)  # as a terminal does
    out, err = interrupted.communicate(timeout=START_S)
    assert (interrupted.returncode, out) == (130, "")
    assert without_stages(err) == (
        f"error: interrupted; finished points are kept in {tmp_path}; to go on, give the same "
        f"command with --out {tmp_path}\n"
    )
    written = first.stat().st_mtime_ns
    assert spikeport(*command).code == 0
    assert first.stat().st_mtime_ns == written
    assert len(list((tmp_path / "points").iterdir())) == 3
    result = json.loads(first.read_text())
    assert (result["experiment"], result["settings"]["network_seed"]) == ("reach", 1)
