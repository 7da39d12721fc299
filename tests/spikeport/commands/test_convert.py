"""``spikeport convert`` as a user types it."""

import json
import sys

import numpy as np
import pytest
import torch
import yaml
from torch import nn

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.decode_path import DecodePath
from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.registry import PASSES, PIPELINES
from spikeport.compile.report.schema import ReportData
from spikeport.experiments.policy import conversion
from spikeport.hardware_models import chip as chips
from spikeport.networks import walking_policy
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.description import DEFAULT_POSE, JOINTS
from tests.helpers.chip_files import chip_file
from tests.helpers.foreign import ENVIRONMENT

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
MADE = "; see docs/convert.md, 'Refused policies'"


@pytest.fixture
def tiny(tmp_path):
    """Return a TorchScript file of a small perceptron."""
    torch.manual_seed(0)
    path = tmp_path / "tiny.pt"
    hidden = [nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 4), nn.Tanh()]
    module = nn.Sequential(*hidden, nn.Linear(4, 2))
    torch.jit.script(module).save(path)
    return path


@pytest.mark.slow
def test_a_policy_file_becomes_an_image_with_errors_and_report(spikeport, tiny, tmp_path):
    seen, out = tmp_path / "seen.npz", tmp_path / "out"
    np.savez(seen, observations=np.random.RandomState(0).randn(50, 3))
    options = ("--observations", seen, "-n", "4", "--tau-fwd", "0.003", "--out", out)
    done = spikeport("convert", tiny, *options, "--json", tmp_path / "report.json")
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[:2] == ["policy: 3-4-4-2, tanh", f"observations: 50 of {seen}"]
    (row,) = (line.split() for line in lines if line.strip().startswith("layer 1 "))
    written = json.loads((out / "conversion.json").read_text())
    layer = written["layers"][0]
    assert row[-2:] == [f"{100 * layer['error']:.1f}", "%"]
    assert f"{100 * written['chip_error']:.1f} % on the chip" in done.out
    assert lines[-2].startswith("fits chip 'loihi' on 1 core")
    assert lines[-1] == f"written: {out}/, {tmp_path / 'report.json'}"
    report = json.loads((out / "report.json").read_text())
    assert (
        ReportData.model_validate(report).image_digest == ChipImage.load(out / "image.npz").digest
    )
    assert json.loads((tmp_path / "report.json").read_text()) == report
    assert not (out / "policy.npz").exists()


@pytest.mark.parametrize("name", ["conversion.json", "policy.npz"])
def test_a_report_in_place_of_the_conversion_s_own_files_is_refused(
    spikeport, tiny, tmp_path, name
):
    out = tmp_path / "out"
    done = spikeport("convert", tiny, "--out", out, "--json", out / name)
    assert done.code == 2
    assert f"--json {out / name}: would replace what --out writes; choose another" in done.err


def test_the_default_passes_have_more_room_for_wiring_from_neuron_to_neuron():
    passes, usual = parse(conversion.PASSES).passes, parse("compact").passes
    assert [type(one) for one in passes] == [type(one) for one in usual]
    assert [one for one in passes if one not in usual] == [DecodePath(slack_cores=16.0)]


def test_a_policy_that_does_not_fit_has_a_report(spikeport, tiny, tmp_path):
    chip = chip_file(tmp_path / "small.toml", cores=1)
    report = tmp_path / "report.json"
    report.write_text("{}")
    done = spikeport("convert", tiny, "-n", "300", "--chip", chip, "--json", report)
    assert done.code == 1
    assert "SP201 cores" in done.err
    found = ReportData.model_validate(json.loads(report.read_text()))
    assert (found.fits, found.violations[0].id) == (False, "SP201")


@pytest.mark.slow
def test_observations_of_a_described_policy_are_those_of_its_description(spikeport, tmp_path):
    torch.manual_seed(0)
    policy, seen, described = (tmp_path / name for name in ("walk.pt", "seen.npz", "env.yaml"))
    module = nn.Sequential(nn.Linear(69, 2), nn.ELU(), nn.Linear(2, 19))
    torch.jit.script(module).save(policy)
    described.write_text(yaml.dump(ENVIRONMENT, sort_keys=False))
    observations = np.random.RandomState(0).randn(50, 69)
    np.savez(seen, observations=observations)
    options = ("--description", described, "--observations", seen, "-n", "2")
    done = spikeport("convert", policy, *options, "--out", tmp_path / "out")
    assert f"observations: 50 of {seen}, in the order of {described}\n" in done.out
    layer = json.loads((tmp_path / "out" / "conversion.json").read_text())["layers"][0]
    with torch.no_grad():
        sums = module[0](torch.tensor(observations, dtype=torch.float)).numpy()
    assert layer["above"] == pytest.approx(np.quantile(sums, 0.995, axis=0).max(), rel=1e-4)


@pytest.mark.slow
def test_observations_of_a_file_of_ours_are_in_its_order_of_joints(spikeport, tmp_path):
    rng = np.random.RandomState(0)
    joints, policy, seen = JOINTS[::-1], tmp_path / "walk.npz", tmp_path / "seen.npz"
    weights, biases = (rng.randn(2, 69), rng.randn(19, 2)), (np.zeros(2), np.zeros(19))
    pose = np.array([DEFAULT_POSE[joint] for joint in joints]) + 0.1
    WalkingPolicy(weights, biases, joints, pose, 0.25).save(policy)
    observations = rng.randn(50, 69)
    np.savez(seen, observations=observations)
    done = spikeport("convert", policy, "--observations", seen, "-n", "2", "--out", tmp_path)
    assert f"observations: 50 of {seen}\n" in done.out
    layer = json.loads((tmp_path / "conversion.json").read_text())["layers"][0]
    wanted = np.quantile(observations @ weights[0].T, 0.995, axis=0).max()
    assert layer["above"] == pytest.approx(wanted)


@pytest.mark.slow
def test_random_observations_are_named_if_no_file_is_given(spikeport, tiny):
    done = spikeport("convert", tiny, "-n", "2")
    assert "observations: 1,000 standard normal ones, without a file of observations\n" in done.out
    assert "hint: rate too low: layer 1 (" in done.out


@pytest.mark.slow
def test_the_refusal_of_a_policy_that_is_too_large_proposes_fewer_neurons(
    spikeport, tiny, tmp_path
):
    chip = chip_file(tmp_path / "small.toml", cores=2, compartments=80)
    refused = spikeport("convert", tiny, "-n", "20", "--chip", chip)
    assert (refused.code, refused.out) == (1, "")
    assert "SP201 cores" in refused.err
    assert refused.err.endswith("more: try -n 10, fewer neurons for each unit than 20\n")
    assert spikeport("convert", tiny, "-n", "10", "--chip", chip).code == 0
    chip = chip_file(tmp_path / "small.toml", cores=1, compartments=10)
    refused = spikeport("convert", tiny, "-n", "2", "--chip", chip)
    assert refused.err.endswith("more: -n 2 is the least; use a policy with fewer units\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["-n", "5"],
            "--neurons 5: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
        (["--tau-fwd", "0"], "--tau-fwd 0: a filter must be above 0 and below 1 s"),
        (
            ["--chip", "loihi9"],
            f"unknown chip 'loihi9'; choose from: {', '.join(sorted(chips.names()))}",
        ),
        (
            ["--passes", "pock"],
            "unknown pass or pipeline 'pock'; choose from: "
            f"{', '.join(sorted(PIPELINES | PASSES))}",
        ),
    ],
)
def test_wrong_options_are_refused(spikeport, tiny, options, message):
    done = spikeport("convert", tiny, *options)
    assert (done.code, done.out) == (2, "")
    assert done.err == f"error: {message}\n"


def test_a_file_that_is_not_there_is_named(spikeport, tmp_path):
    path = tmp_path / "none.pt"
    assert spikeport("convert", path) == (2, "", f"error: {path}: no such file\n")


def test_a_name_that_no_shipped_policy_has_is_refused(spikeport):
    assert spikeport("convert", "h1_wlk").err == (
        "error: unknown policy 'h1_wlk'; choose from: h1_robust, h1_walk, the path of a file\n"
    )


def test_a_file_that_is_not_a_policy_is_refused(spikeport, tmp_path):
    path = tmp_path / "text.pt"
    path.write_text("no policy")
    expected = "expected npz or TorchScript or checkpoint or ONNX, found none of them"
    assert spikeport("convert", path) == (
        2,
        "",
        f"error: policy file '{path}': {expected}{MADE}\n",
    )


def test_observations_of_another_size_are_refused(spikeport, tiny, tmp_path):
    seen = tmp_path / "seen.npz"
    np.savez(seen, np.ones((4, 5)))
    done = spikeport("convert", tiny, "--observations", seen)
    assert done.code == 2
    assert "expected an array (m, 3), found shape (4, 5)" in done.err


@pytest.mark.parametrize(
    ("named", "complaint"),
    [
        ("swish", f"expected activation elu or relu or tanh or silu or gelu, found swish{MADE}"),
        (
            "relu",
            "expected activation relu, as --activation says, found tanh; leave out --activation: "
            "the file names its own activation",
        ),
    ],
)
def test_an_activation_other_than_the_files_is_refused(spikeport, tiny, named, complaint):
    done = spikeport("convert", tiny, "--activation", named)
    assert done == (2, "", f"error: policy file '{tiny}': {complaint}\n")


def test_the_default_activation_of_checkpoints_is_refused_if_the_file_names_another(
    spikeport, tiny
):
    done = spikeport("convert", tiny, "--activation", "elu")
    assert (done.code, done.out) == (2, "")
    assert "expected activation elu, as --activation says, found tanh; leave out" in done.err


def test_a_walking_policy_has_one_output(spikeport):
    done = spikeport("convert", "h1_walk", "--output", "mu")
    assert (done.code, done.out) == (2, "")
    assert done.err.endswith("whose outputs have names, found npz; leave out --output\n")


@pytest.mark.slow
def test_bounds_of_observation_and_action_are_named(spikeport, tmp_path):
    path = tmp_path / "bounded.pt"
    layers = nn.Hardtanh(), nn.Linear(3, 4), nn.ReLU(), nn.Linear(4, 2), nn.Tanh()
    torch.jit.script(nn.Sequential(*layers)).save(path)
    done = spikeport("convert", path, "-n", "2")
    assert done.out.splitlines()[0] == (
        "policy: 3-4-2, relu, clip of the observation, tanh of the action"
    )


@pytest.mark.slow
def test_the_activation_that_the_file_names_may_be_given(spikeport, tiny):
    done = spikeport("convert", tiny, "--activation", "tanh", "-n", "2")
    assert (done.code, done.out.splitlines()[0]) == (0, "policy: 3-4-4-2, tanh")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "activation"),
    [
        ((), "elu (assumed: a checkpoint names none; give it with --activation)"),
        (("--activation", "relu"), "relu"),
    ],
)
def test_an_assumed_activation_of_a_checkpoint_is_printed_as_such(
    spikeport, tmp_path, options, activation
):
    path = tmp_path / "model.pt"
    actor = nn.Sequential(nn.Linear(3, 4), nn.ELU(), nn.Linear(4, 2)).state_dict(prefix="actor.")
    torch.save({"model_state_dict": {**actor, "std": torch.ones(2)}}, path)
    done = spikeport("convert", path, "-n", "2", *options)
    assert (done.code, done.out.splitlines()[0]) == (0, f"policy: 3-4-2, {activation}")
    (row,) = (line for line in done.out.splitlines() if line.strip().startswith("layer 1 "))
    assert ("  0 .. " in row) == (activation == "relu")  # ReLU has no neurons below zero


def test_an_unknown_activation_of_a_checkpoint_is_refused(spikeport, tmp_path):
    path = tmp_path / "model.pt"
    layers = nn.Sequential(nn.Linear(3, 4), nn.ELU(), nn.Linear(4, 2)).state_dict()
    state = {f"mlp.{name}": value for name, value in layers.items()}
    state["distribution.std_param"] = torch.ones(2)
    torch.save({"actor_state_dict": state}, path)
    done = spikeport("convert", path, "--activation", "sine")
    assert done.code == 2
    assert "expected activation elu or relu or tanh or silu or gelu, found sine" in done.err


@pytest.mark.parametrize("policy", [walking_policy.SHIPPED, "h1_robust"])
def test_converting_a_walking_policy_without_mujoco_names_the_robot_extra(
    spikeport, monkeypatch, policy
):
    for name in [n for n in sys.modules if n.startswith("spikeport.robot")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "spikeport.experiments.policy.settings", raising=False)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = spikeport("convert", policy)
    assert done.code == 2
    assert done.err.endswith("install it with: pip install 'spikeport[robot]'\n")


def test_the_policy_is_not_replaced_by_its_copy(spikeport, tmp_path):
    policy = tmp_path / "policy.npz"
    policy.write_text("")
    done = spikeport("convert", policy, "--out", tmp_path)
    assert done.code == 2
    assert done.err == (
        f"error: --out {policy}: would replace what the command reads; choose another\n"
    )
