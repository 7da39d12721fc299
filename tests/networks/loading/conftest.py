"""Files of policies, written by the libraries that write them elsewhere."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from rsl_rl.models import MLPModel
from tensordict import TensorDict
from torch import nn

from spikeport.errors import UsageError
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.policy_values import exact

SIZES = (5, 7, 6, 3)
CURE = "; what can be read: spikeport convert --help"


TERMS = {
    "base_lin_vel": "base_lin_vel",
    "base_ang_vel": "base_ang_vel",
    "projected_gravity": "projected_gravity",
    "velocity_commands": "generated_commands",
    "joint_pos": "joint_pos_rel",
    "joint_vel": "joint_vel_rel",
    "actions": "last_action",
}
LEGS = {".*_hip_yaw": 150.0, ".*_hip_roll": 150.0, ".*_hip_pitch": 200.0, ".*_knee": 200.0}
ENVIRONMENT: dict[str, Any] = {
    "sim": {"dt": 0.005, "gravity": (0.0, 0.0, -9.81), "device": "cuda:0"},
    "decimation": 4,
    "scene": {
        "num_envs": 4096,
        "robot": {
            "init_state": {
                "pos": (0.0, 0.0, 1.05),
                "joint_pos": {
                    ".*_hip_pitch": -0.28,
                    ".*_knee": 0.79,
                    ".*_ankle": -0.52,
                    "torso": 0.0,
                    ".*_shoulder_pitch": 0.28,
                    ".*_elbow": 0.52,
                },
            },
            "actuators": {
                "legs": {
                    "joint_names_expr": [*LEGS, "torso"],
                    "stiffness": {**LEGS, "torso": 200.0},
                    "damping": {**dict.fromkeys(LEGS, 5.0), "torso": 5.0},
                },
                "feet": {
                    "joint_names_expr": [".*_ankle"],
                    "stiffness": {".*_ankle": 20.0},
                    "damping": 4.0,
                },
                "arms": {
                    "joint_names_expr": [".*_shoulder_.*", ".*_elbow"],
                    "stiffness": 40.0,
                    "damping": 10.0,
                },
            },
        },
    },
    "observations": {
        "policy": {
            "concatenate_terms": True,
            "history_length": None,
            "height_scan": None,
            **{
                name: {
                    "func": f"isaaclab.envs.mdp.observations:{function}",
                    "params": {"asset_cfg": {"joint_ids": slice(None)}},
                    "noise": {"n_min": -0.1, "n_max": 0.1},
                    "clip": None,
                    "scale": None,
                    "history_length": 0,
                }
                for name, function in TERMS.items()
            },
        }
    },
    "actions": {
        "joint_pos": {
            "class_type": "isaaclab.envs.mdp.actions.joint_actions:JointPositionAction",
            "joint_names": [".*"],
            "scale": 0.5,
            "offset": 0.0,
            "clip": None,
            "preserve_order": False,
            "use_default_offset": True,
        }
    },
}


@pytest.fixture
def observations() -> np.ndarray:
    return np.random.default_rng(3).standard_normal((20, SIZES[0]))


@pytest.fixture
def agrees(observations) -> Callable[[Mlp, nn.Module], None]:
    """Asserts that layers compute what a module does."""

    def check(mlp: Mlp, module: nn.Module) -> None:
        with torch.no_grad():
            wanted = module(torch.tensor(observations, dtype=torch.float)).numpy()
        found = exact(mlp.layers, observations, mlp.activation)[-1]
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-5)
        assert np.abs(wanted).max() > 0.1

    return check


@pytest.fixture
def sequential() -> Callable[..., nn.Sequential]:
    """A module of dense layers with an activation between them."""

    def make(activation: Callable[[], nn.Module] = nn.ELU) -> nn.Sequential:
        torch.manual_seed(0)
        n, first, second, m = SIZES
        hidden = [nn.Linear(n, first), activation(), nn.Linear(first, second), activation()]
        return nn.Sequential(*hidden, nn.Linear(second, m)).eval()

    return make


@pytest.fixture
def actor() -> MLPModel:
    """rsl-rl's actor, which has seen some observations."""
    torch.manual_seed(1)
    seen = TensorDict({"policy": 2 + 3 * torch.randn(64, SIZES[0])}, batch_size=64)
    model = MLPModel(
        seen,
        {"actor": ["policy"]},
        "actor",
        SIZES[-1],
        SIZES[1:-1],
        "elu",
        obs_normalization=True,
        distribution_cfg={"class_name": "GaussianDistribution", "init_std": 1.0},
    )
    for _ in range(3):
        model.update_normalization(seen)
    return model.eval()


@pytest.fixture
def refusal() -> Callable[..., str]:
    """What `load_mlp` says of a file, without the file's name and the cure."""

    def message(path: Path) -> str:
        with pytest.raises(UsageError) as error:
            load_mlp(path)
        before, _, text = str(error.value).partition(": ")
        assert before == f"policy file '{path}'"
        assert text.endswith(CURE)
        return text.removesuffix(CURE)

    return message


@pytest.fixture
def environment(tmp_path) -> Callable[..., Path]:
    """Writes Isaac Lab's description of the H1; changes are by place, as ``{"sim/dt": 0.01}``."""

    def write(changes: dict[str, Any] | None = None) -> Path:
        content = copy.deepcopy(ENVIRONMENT)
        for place, value in (changes or {}).items():
            *parents, name = place.split("/")
            part = content
            for parent in parents:
                part = part[parent]
            part[name] = value
        path = tmp_path / "env.yaml"
        path.write_text(yaml.dump(content, default_flow_style=False, sort_keys=False))
        return path

    return write


@pytest.fixture
def module() -> nn.Sequential:
    """A walking policy of few units."""
    torch.manual_seed(4)
    layers = [nn.Linear(69, 8), nn.ELU(), nn.Linear(8, 8), nn.ELU(), nn.Linear(8, 19)]
    return nn.Sequential(*layers).double().eval()


@pytest.fixture
def path(tmp_path, module) -> Path:
    """The file of that policy."""
    torch.jit.script(module).save(tmp_path / "policy.pt")
    return tmp_path / "policy.pt"
