"""Policies from other sources, and parts of files that no library would write."""

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from spikeport.networks.loading import isaac
from spikeport.networks.loading.refusal import refusing

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


class Policy(nn.Module):
    """A policy with a method that writes, which nobody calls."""

    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(0)
        self.net = nn.Sequential(nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3))

    def forward(self, x: Tensor) -> Tensor:
        return self.net(x)

    @torch.jit.export
    def reset(self, x: Tensor) -> None:
        torch.save(x, "harm")


def members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as read:
        return {name: read.read(name) for name in read.namelist()}


def pack(path: Path, content: dict[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as written:
        for name, value in content.items():
            written.writestr(name, value)


class Reduced:
    def __init__(self, function: Callable[..., object], *arguments: object) -> None:
        self.called = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return self.called


def by_instructions(*made: bytes) -> bytes:
    return b"\x80\x02" + b"".join(made) + b"."


def state(**others: object) -> dict[str, object]:
    tensors = {"mlp.0.weight": torch.ones(4, 5), "mlp.0.bias": torch.ones(4)}
    tensors |= {"mlp.2.weight": torch.ones(3, 4), "mlp.2.bias": torch.ones(3)}
    return {**tensors, "distribution.std_param": torch.ones(3), **others}


def described(path: Path) -> None:
    """Read a description; refuse a wrong file with the same error as for a policy."""
    with refusing(path):
        isaac.described(path)
