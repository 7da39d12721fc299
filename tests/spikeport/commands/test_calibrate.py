"""``spikeport calibrate`` as a user types it; tests/experiments tests the calibrations."""

import dataclasses

import numpy as np
import pytest

from spikeport.experiments import registry
from spikeport.experiments.arm.reach import ReachTrial
from spikeport.experiments.calibration import DecoderCalibration, load
from spikeport.experiments.trial import Trial
from spikeport.networks import walking_policy

FOUND = DecoderCalibration(
    {"experiment": "reach"}, "0123456789abcdef" * 4, {"M1 x": np.ones((300, 4))}
)


@pytest.fixture
def asked(monkeypatch):
    """Return the requests to calibrate; each is answered with decoders."""
    requests = []

    class Answering(ReachTrial):
        def calibrate(self):
            requests.append((self.settings, self.options))
            return FOUND

    experiment = dataclasses.replace(registry.get("reach"), trial=Answering)
    monkeypatch.setattr(registry, "get", lambda _name: experiment)
    return requests


def test_decoders_are_written_and_the_image_named(spikeport, asked, tmp_path):
    path = tmp_path / "decoders.npz"
    done = spikeport(
        "calibrate", "reach", "--set", "m1=40", "--passes", "compact", "--out", str(path)
    )
    message = f"1,200 decoders refitted on image 0123456789abcdef\nwritten: {path}\n"
    assert done == (0, message, "")
    assert load(path, FOUND.made_for, {"M1 x": (300, 4)}).image_digest == FOUND.image_digest
    ((settings, options),) = asked
    assert settings.m1 == 40
    assert (options.backend, options.chip, options.pipeline) == ("native", "loihi", "compact")


def test_an_experiment_without_decoders_is_refused(spikeport, monkeypatch, tmp_path):
    class WithoutDecoders(ReachTrial):
        calibrate = Trial.calibrate

    experiment = dataclasses.replace(registry.get("reach"), trial=WithoutDecoders)
    monkeypatch.setattr(registry, "get", lambda _name: experiment)
    message = "error: experiment 'reach' has no decoders to calibrate\n"
    assert spikeport("calibrate", "reach", "--out", str(tmp_path / "f.npz")) == (2, "", message)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--backend", "analytic"],
            "unknown backend with neurons of reach 'analytic'; "
            "choose from: board, native, native-threads, nengo-loihi, "
            "reference",
        ),
        (
            ["--seconds", "0"],
            "--seconds 0: reach simulates at least 0.005 s, and at most 1,000,000,000 steps of "
            "0.001 s",
        ),
        (["--set", "m1=0"], "m1=0: the number of neurons must be at least 1"),
        (
            ["--set", "calibrated=false"],
            "--set calibrated=false: the command finds a calibration of its own; leave it out",
        ),
    ],
)
def test_wrong_options_are_refused_before_anything_is_measured(
    spikeport, asked, tmp_path, options, message
):
    path = tmp_path / "f.npz"
    done = spikeport("calibrate", "reach", "--out", str(path), *options)
    assert done == (2, "", f"error: {message}\n")
    assert (asked, path.exists()) == ([], False)


def test_nothing_but_a_calibration_is_replaced(spikeport, asked, tmp_path):
    policy, script = tmp_path / "policy.npz", tmp_path / "model.py"
    walking_policy.load().save(policy)
    script.write_text("print()")
    for path in (policy, script):
        before = path.read_bytes()
        message = f"error: --out {path}: exists, and is not a calibration; choose another\n"
        assert spikeport("calibrate", "reach", "--out", str(path)) == (2, "", message)
        assert path.read_bytes() == before
    assert asked == []
    for _ in range(2):
        assert spikeport("calibrate", "reach", "--out", str(tmp_path / "own.npz")).code == 0


def test_a_folder_in_place_of_the_file_is_refused(spikeport, asked, tmp_path):
    message = f"error: --out {tmp_path}: is not a file that can be replaced; choose another\n"
    assert spikeport("calibrate", "reach", "--out", str(tmp_path)) == (2, "", message)


def test_a_missing_calibration_is_named(spikeport, tmp_path):
    path, out = tmp_path / "none.npz", tmp_path / "run"
    done = spikeport("run", "reach", "--set", f"calibrated={path}", "--out", str(out))
    cure = "cure: one of true, false, or the path of a file"
    assert done == (2, "", f"error: calibrated={path}: no such file; {cure}\n")
    assert not out.exists()


def test_settings_that_a_run_would_refuse_are_refused_before_the_work(spikeport, tmp_path):
    done = spikeport("calibrate", "switch", "--set", "selection=spa", "--out", tmp_path / "f.npz")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error: selection=spa: neurons have one filter on backend 'native'")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            "path=loop",
            "--set path: changes a run, and not the decoders that are calibrated; cure: leave it "
            "out here, and give it to `run`",
        ),
        (
            "silence_at=3",
            "silence_at: does nothing without silence, which is 0; cure: a value of silence beside "
            "it, or leave it out",
        ),
    ],
)
def test_settings_that_do_nothing_are_refused(spikeport, tmp_path, setting, message):
    done = spikeport("calibrate", "walk", "--set", setting, "--out", tmp_path / "f.npz")
    assert done == (2, "", f"error: {message}\n")


def test_perturbations_which_no_calibration_depends_on_are_refused(spikeport, tmp_path):
    done = spikeport("calibrate", "walk", "--set", "push=0.8", "--out", tmp_path / "f.npz")
    assert done.code == 2
    assert done.err.startswith("error: --set push: calibrations are made without perturbations")
