"""``spikeport train`` as a user types it; tests/training tests the results of training."""

import os
import sys
from pathlib import Path

import pytest

from spikeport.atomic import locked


def test_help_names_every_option(spikeport):
    done = spikeport("train", "--help")
    assert done.code == 0
    options = ("--out", "--seed", "--steps", "--threads", "--no-hidden-noise")
    assert [option for option in options if option not in done.out] == []


def test_an_unknown_policy_lists_the_known_ones(spikeport):
    assert spikeport("train", "run") == (2, "", "error: unknown policy 'run'; choose from: walk\n")


def test_a_file_in_place_of_the_folder_of_a_run_is_refused(spikeport, tmp_path):
    path = tmp_path / "file"
    path.touch()
    message = f"error: --out {path}: is a file; choose a folder\n"
    assert spikeport("train", "walk", "--out", str(path)) == (2, "", message)


def test_a_folder_of_a_sweep_or_in_use_is_refused(spikeport, tmp_path):
    pytest.importorskip("rsl_rl")
    with locked(tmp_path):
        done = spikeport("train", "walk", "--out", str(tmp_path))
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith(f"error: {tmp_path}: another process writes into it")
    (tmp_path / "sweep.json").touch()
    message = f"error: --out {tmp_path}: holds a run, sweep.json; choose another folder\n"
    assert spikeport("train", "walk", "--out", str(tmp_path)) == (2, "", message)


def test_help_names_the_steps_of_a_segment(spikeport):
    pytest.importorskip("rsl_rl")
    from spikeport.training.train import TrainOptions

    steps = TrainOptions(Path()).steps_per_segment
    assert f"{steps:,}" in spikeport("train", "--help").out


def test_the_error_without_torch_names_the_extra(spikeport, tmp_path, monkeypatch):
    for name in [n for n in sys.modules if n.startswith("spikeport.training")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "torch", None)
    message = (
        "error: training needs the package torch, which is absent; "
        "install it with: pip install 'spikeport[train]'\n"
    )
    assert spikeport("train", "walk", "--out", str(tmp_path)) == (2, "", message)


@pytest.mark.parametrize("option", ["--steps", "--threads"])
def test_zero_steps_or_threads_are_refused(spikeport, option):
    done = spikeport("train", "walk", option, "0")
    assert done.code == 2
    assert f"Invalid value for '{option}'" in done.err


@pytest.mark.parametrize(
    ("options", "workers", "ending"),
    [
        (("--threads", 3, "--no-hidden-noise"), 3, "--threads 3 --no-hidden-noise"),
        ((), 5, "--threads 5"),
    ],
)
def test_a_policy_is_trained_as_asked_and_its_evaluations_are_printed(
    spikeport, tmp_path, monkeypatch, options, workers, ending
):
    pytest.importorskip("rsl_rl")
    from spikeport.training import walk
    from spikeport.training.curriculum import STAGES, without_hidden_noise
    from spikeport.training.evaluate import Evaluation
    from spikeport.training.train import TrainOptions

    asked = []

    def train_walk(*arguments):
        asked.extend(arguments[:2])
        return {
            "as trained": Evaluation(200, 7, 0.123456, 0.2, 0.05, 2.5, 0.01),
            "undisturbed": Evaluation(200, 0, 0.1, 0.1, 0.06, 2.25, 0.0),
        }

    monkeypatch.setattr(walk, "train_walk", train_walk)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: set(range(5)))
    out = tmp_path / "out"
    done = spikeport("train", "walk", "--out", out, "--seed", 4, "--steps", 9000, *options)
    assert (done.code, done.err) == (0, "")
    stages = without_hidden_noise() if "--no-hidden-noise" in options else STAGES
    assert asked == [
        TrainOptions(out, 4, 9000, stages=stages, workers=workers),
        f"spikeport train walk --seed 4 --steps 9000 {ending}",
    ]
    rows = [line.split() for line in done.out.splitlines()]
    assert ["walking", "as", "trained", "undisturbed"] in rows
    assert ["fallen", "7", "0"] in rows
    assert ["vx_error_m_s", "0.1235", "0.1"] in rows
