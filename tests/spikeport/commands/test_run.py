"""``spikeport run`` as a user types it; tests/experiments tests the results of runs."""

import errno
import json
import os
import signal
import time

import pytest
from matplotlib.figure import Figure

from spikeport.commands.run import show_outcome
from spikeport.experiments import registry
from spikeport.experiments.arm.reach import ReachTrial
from spikeport.experiments.options import Outcome
from spikeport.experiments.switch.schedule import SHIPPED
from spikeport.hardware_models import chip as chips

ANALYTIC = ("run", "reach", "--backend", "analytic", "--seconds", "0.05")
REACH_BACKENDS = ", ".join(sorted(registry.get("reach").backends))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.slow
def test_run_writes_its_folder_and_prints_the_metrics(spikeport, tmp_path):
    out = tmp_path / "a" / "run"
    done = spikeport(*ANALYTIC, "--out", out)
    assert (done.code, done.err) == (0, "")
    assert names(out) == ["figure.png", "probes.nc", "result.json"]
    result = json.loads((out / "result.json").read_text())
    assert [name for name in result["metrics"] if name not in done.out] == []
    assert f"written: {out}/ (figure.png, probes.nc, result.json)\n" in done.out
    assert result["command"] == ["spikeport", *ANALYTIC, "--out", str(out)]


@pytest.mark.parametrize("options", [("--passes", "compact"), ("--chip", "loihi2")])
def test_options_of_a_compile_are_refused_without_neurons(spikeport, tmp_path, options):
    assert spikeport(*ANALYTIC, *options, "--out", tmp_path / "run") == (
        2,
        "",
        f"error: {options[0]}: for backend 'analytic' nothing is compiled; leave it out, or choose "
        "--backend native\n",
    )


@pytest.fixture
def without_figure(monkeypatch):
    """Draw nothing: a figure takes a second."""
    monkeypatch.setattr(ReachTrial, "figure", lambda *_: Figure())


@pytest.mark.slow
@pytest.mark.usefixtures("without_figure")
def test_a_run_without_out_goes_into_a_folder_of_its_own(spikeport, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert spikeport(*ANALYTIC).code == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("reach-")
    assert (folder / "result.json").is_file()


@pytest.mark.parametrize(("key", "needed"), [("push_every=2", "push"), ("silence_at=0", "silence")])
def test_a_setting_that_does_nothing_is_refused(spikeport, tmp_path, key, needed):
    walk = ("run", "walk", "--backend", "analytic", "--seconds", "0.05", "--out", tmp_path / "run")
    done = spikeport(*walk, "--set", key)
    name = key.partition("=")[0]
    assert done == (
        2,
        "",
        f"error: {name}: does nothing without {needed}, which is 0; cure: a value of {needed} "
        "beside it, or leave it out\n",
    )
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("experiment", "setting"),
    [
        ("reach", "preset=paper"),
        ("draw", "efference_copy=true"),
        ("walk", "n_neurons=20"),
        ("walk", "follower=spiking"),
        ("switch", "units=lif"),
        ("switch", "selection=own"),
    ],
)
def test_a_setting_of_neurons_is_refused_without_neurons(spikeport, tmp_path, experiment, setting):
    run = ("run", experiment, "--backend", "analytic", "--out", tmp_path / "run")
    assert spikeport(*run, "--set", setting) == (
        2,
        "",
        f"error: {setting.partition('=')[0]}: does nothing on backend 'analytic', which has no "
        "neurons; cure: --backend native, or leave it out\n",
    )
    assert not (tmp_path / "run").exists()


def test_a_digit_is_refused_for_a_schedule_that_draws_none(spikeport, tmp_path):
    schedule = tmp_path / "reaching.toml"
    schedule.write_text(SHIPPED["switch"].read_text().replace('arm = "digit"', 'arm = "reach"'))
    run = ("run", "switch", "--set", f"schedule={schedule}", "--out", tmp_path / "run")
    assert spikeport(*run, "--set", "digit=3") == (
        2,
        "",
        'error: digit: does nothing in a schedule that draws none; cure: a phase with arm = "digit"'
        ", or leave it out\n",
    )


def test_a_setting_of_the_policys_neurons_is_refused_for_the_exact_policy(spikeport, tmp_path):
    run = ("run", "walk", "--set", "policy=mlp", "--out", tmp_path / "run")
    done = spikeport(*run, "--set", "tau_fwd=0.002")
    assert done == (
        2,
        "",
        "error: tau_fwd: does nothing with policy=mlp, which has no neurons; cure: policy=spiking, "
        "or leave it out\n",
    )


def test_unknown_names_of_run_list_the_known_ones(spikeport, tmp_path):
    def error(*arguments):
        done = spikeport("run", *arguments, "--out", tmp_path / "run")
        assert (done.code, done.out) == (2, "")
        return done.err

    known = ", ".join(sorted(registry.EXPERIMENTS))
    assert error("dance") == f"error: unknown experiment 'dance'; choose from: {known}\n"
    assert error("reach", "--backend", "brd") == (
        f"error: unknown backend of reach 'brd'; choose from: {REACH_BACKENDS}\n"
    )
    assert error("reach", "--chip", "lohi") == (
        f"error: unknown chip 'lohi'; choose from: {', '.join(chips.names())}\n"
    )
    assert error("reach", "--set", "box=huge") == (
        "error: unknown box 'huge'; choose from: large, small, x0:x1,y0:y1,z0:z1 (m)\n"
    )
    assert error("reach", "--set", "preset=fat") == (
        "error: unknown preset 'fat'; choose from: lean, paper\n"
    )
    assert error("reach", "--set", "n=1") == (
        "error: unknown key of experiment 'reach' 'n'; "
        "choose from: appearance, box, calibrated, cb, efference_copy, m1, network_seed, "
        "preset, s1\n"
    )
    assert error("reach", "--set", "m1=0") == (
        "error: m1=0: the number of neurons must be at least 1\n"
    )
    assert error("reach", "--set", "network_seed=-1") == (
        "error: network_seed=-1: a seed must be from 0 to 4294967295\n"
    )
    assert names(tmp_path) == []


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "0.004", "1e+300", "1e+10"])
def test_a_time_that_cannot_be_simulated_is_refused(spikeport, tmp_path, seconds):
    done = spikeport(*ANALYTIC[:4], "--seconds", seconds, "--out", tmp_path / "run")
    assert done == (
        2,
        "",
        f"error: --seconds {seconds}: reach simulates at least 0.005 s, and at most 1,000,000,000 "
        "steps of 0.001 s\n",
    )
    assert names(tmp_path) == []


def test_a_time_of_no_whole_steps_is_refused(spikeport, tmp_path):
    done = spikeport(*ANALYTIC[:4], "--seconds", "0.0501", "--out", tmp_path / "run")
    assert done == (
        2,
        "",
        "error: --seconds 0.0501: must be a whole number of steps of 0.001 s; cure: 0.05\n",
    )
    assert names(tmp_path) == []


def test_out_that_is_a_file_is_refused(spikeport, tmp_path):
    out = tmp_path / "file"
    out.write_text("mine")
    cure = "choose another --out"
    done = spikeport(*ANALYTIC, "--out", out, "--overwrite")
    assert done == (2, "", f"error: {out}: cannot be made (File exists); {cure}\n")
    below = out / "run"
    done = spikeport(*ANALYTIC, "--out", below)
    assert done == (2, "", f"error: {below}: cannot be made (Not a directory); {cure}\n")
    assert out.read_text() == "mine"


def test_out_that_cannot_be_written_to_is_refused_before_the_run(spikeport, tmp_path, monkeypatch):
    # not by chmod: root may write anywhere
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    done = spikeport(*ANALYTIC, "--out", tmp_path)
    assert done == (2, "", f"error: {tmp_path}: cannot be written to; choose another --out\n")


@pytest.mark.slow
@pytest.mark.usefixtures("without_figure")
def test_overwrite_replaces_a_run(spikeport, tmp_path):
    first, second = (*ANALYTIC, "--out", tmp_path), (*ANALYTIC, "--seed", "1", "--out", tmp_path)
    assert spikeport(*first).code == 0
    before = (tmp_path / "result.json").read_text()
    assert spikeport(*second) == (
        2,
        "",
        f"error: {tmp_path}: holds a run; choose another --out, or give --overwrite\n",
    )
    assert (tmp_path / "result.json").read_text() == before
    assert spikeport(*second, "--overwrite").code == 0
    assert json.loads((tmp_path / "result.json").read_text())["seeds"]["run"] == 1


def test_overwrite_replaces_nothing_but_runs(spikeport, tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    (tmp_path / "result.json").write_text("{}")
    done = spikeport(*ANALYTIC, "--out", tmp_path, "--overwrite")
    assert done == (2, "", f"error: {tmp_path}: holds more than a run; choose another --out\n")
    assert names(tmp_path) == ["result.json", "thesis.tex"]


@pytest.mark.slow
@pytest.mark.usefixtures("without_figure", "with_kept")
def test_an_earlier_run_is_kept_if_the_new_network_does_not_fit(spikeport, tmp_path):
    out = tmp_path / "run"
    assert spikeport(*ANALYTIC, "--out", out).code == 0
    before = (out / "result.json").read_text()
    text = (chips.BUILT_IN / "loihi.toml").read_text()
    small = tmp_path / "small.toml"
    small.write_text(text.replace("value = 128", "value = 1", 1).replace('"loihi"', '"small"', 1))
    sizes = ("--set", "m1=1", "--set", "cb=1", "--set", "s1=1")
    done = spikeport("run", "reach", *sizes, "--chip", small, "--out", out, "--overwrite")
    assert done.code == 1
    assert done.err.startswith(
        "error: the network does not fit chip 'small':\n  small: SP201 cores: "
    )
    assert (out / "result.json").read_text() == before


@pytest.mark.slow
@pytest.mark.usefixtures("without_figure")
def test_a_full_disk_leaves_no_result_and_the_earlier_run(spikeport, tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out, earlier = tmp_path / "run", tmp_path / "earlier"
    assert spikeport(*ANALYTIC, "--out", earlier).code == 0
    before = (earlier / "result.json").read_text()
    monkeypatch.setattr(os, "fsync", full)
    done = spikeport(*ANALYTIC, "--out", out)
    assert done == (1, "", f"error: {out}/probes.nc: No space left on device\n")
    assert spikeport(*ANALYTIC, "--out", earlier, "--overwrite").code == 1
    assert names(tmp_path) == ["earlier"]
    assert (earlier / "result.json").read_text() == before
    assert names(earlier) == ["figure.png", "probes.nc", "result.json"]


@pytest.mark.slow
def test_an_interrupted_run_says_so_and_leaves_no_result(start, without_stages, tmp_path):
    out = tmp_path / "run"
    process = start(
        *("run", "reach", "--backend", "analytic", "--seconds", "3600", "--out", out),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not out.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert (process.returncode, stdout) == (130, "")
    assert without_stages(stderr) == "error: interrupted; no result was completed\n"
    assert not out.exists()


RESULT = {"experiment": "switch", "backend": "native", "energy_by_unit": {}} | dict.fromkeys(
    ("link", "robot")
)


def test_metrics_of_phases_are_printed_line_by_line(tmp_path, capsys):
    phases = [
        {"name": "walk", "success": True, "behind_m": 0.1, "spikes_by_nucleus": {}},
        {"name": "draw", "success": False},
    ]
    result = {**RESULT, "metrics": {"phases": phases}}
    show_outcome(Outcome(result, report=None, activity=None), tmp_path)
    printed = [line.strip() for line in capsys.readouterr().out.splitlines()]
    first = next(i for i, line in enumerate(printed) if line.startswith("phases"))
    walk = "walk: success yes, behind_m 0.1, spikes_by_nucleus -"
    assert printed[first].split(maxsplit=1)[1] == walk
    assert printed[first + 1] == "draw: success no"


def test_names_of_phases_are_not_read_as_markup(tmp_path, capsys):
    phases = [{"name": "[/a] [red]b", "success": True}]
    result = {**RESULT, "metrics": {"phases": phases}}
    show_outcome(Outcome(result, report=None, activity=None), tmp_path)
    assert "[/a] [red]b: success yes" in capsys.readouterr().out
