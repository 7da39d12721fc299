"""Settings of a policy that walks."""

from pathlib import Path

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.policy import settings as module
from spikeport.experiments.policy.settings import CONVERSION, PolicySettings, load_policy
from spikeport.networks import walking_policy
from spikeport.networks.policy import PolicyOptions


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"policy": "mlp"},
            "unknown policy 'mlp'; choose from: h1_robust, h1_walk, spiking, the path of a file",
        ),
        (
            {"policy": "no.npz"},
            "policy=no.npz: no such file; cure: one of spiking, h1_robust, h1_walk, or the path of "
            "a file",
        ),
        (
            {"policy": "h1_robust", "description": "env.yaml"},
            "description=env.yaml: describes the file of a policy; give --set policy=FILE, or "
            "leave it out",
        ),
        (
            {"description": "env.yaml"},
            "description=env.yaml: describes the file of a policy; give --set policy=FILE, or "
            "leave it out",
        ),
        (
            {"n_neurons": 7},
            "n_neurons=7: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
        ({"tau_fwd": 0.0}, "tau_fwd=0: a filter must be above 0 and below 1 s"),
        ({"tau_out": 1.0}, "tau_out=1: a filter must be above 0 and below 1 s"),
        (
            {"calibrated": ""},
            "unknown calibrated ''; choose from: auto, false, the path of a file, true",
        ),
        (
            {"calibrated": "no.npz"},
            "calibrated=no.npz: no such file; cure: one of true, false, auto, or the path of a "
            "file",
        ),
        ({"gait": "wild"}, "unknown gait 'wild'; choose from: calm, rough"),
        ({"network_seed": -1}, "network_seed=-1: a seed must be from 0 to 4294967295"),
        ({"units": "hh"}, "unknown units 'hh'; choose from: bent, hybrid, if, lif, relu"),
    ],
)
def test_a_wrong_setting_says_what_is_allowed(wrong, message):
    with pytest.raises(UsageError) as caught:
        PolicySettings(**wrong)
    assert str(caught.value) == message


def test_settings_of_the_conversion_become_the_policys_options():
    settings = PolicySettings(n_neurons=4, tau_out=0.01)
    assert tuple(settings.conversion) == CONVERSION
    assert settings.policy_options == PolicyOptions(n_neurons=4, tau_out=0.01)
    assert PolicySettings(n_neurons=20).policy_options == PolicyOptions()


@pytest.mark.parametrize("name", ["h1_walk", "h1_robust"])
def test_a_shipped_policy_is_found_by_its_name_in_any_folder(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    settings, file = PolicySettings(policy=name), walking_policy.SHIPPED.with_name(f"{name}.npz")
    assert (settings.walking_policy().weights[0] == load_policy(file).weights[0]).all()
    assert settings.files == []


def test_a_policy_is_the_shipped_one_or_that_of_a_file(tmp_path):
    shipped = walking_policy.load()
    assert PolicySettings().walking_policy().joints == shipped.joints
    shipped.save(tmp_path / "mine.npz")
    mine = PolicySettings(policy=str(tmp_path / "mine.npz")).walking_policy()
    assert (mine.weights[0] == shipped.weights[0]).all()


def test_a_policy_file_is_loaded_with_its_description(tmp_path, monkeypatch):
    (mine := tmp_path / "mine.npz").touch()
    monkeypatch.setattr(module, "load_policy", lambda *given, **_options: given)
    settings = PolicySettings(policy=str(mine), description="env.yaml")
    assert settings.walking_policy() == (mine, Path("env.yaml"))
