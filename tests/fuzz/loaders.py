"""What is fuzzed: loaders by name, with good files of their own. A further one is one line."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
import yaml
from torch import nn

from spikeport.networks import walking_policy
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.walking_policy import WalkingPolicy
from tests.helpers.foreign import ENVIRONMENT, Policy, described, state


class Loader(NamedTuple):
    """A function that reads a file, and one that writes good files into a folder."""

    write: Callable[[Path], object]
    load: Callable[[Path], object]


def _npz(folder: Path) -> None:
    rng = np.random.default_rng(0)
    weights = (rng.standard_normal((4, 5)), rng.standard_normal((2, 4)))
    biases, joints = (np.zeros(4), np.zeros(2)), ("left", "right")
    WalkingPolicy(weights, biases, joints, np.zeros(2), 0.5).save(folder / "policy.npz")


def _torchscript(folder: Path) -> None:
    module = Policy().eval()
    scripted = torch.jit.script(module)
    scripted.save(folder / "scripted.pt")
    torch.jit.freeze(scripted).save(folder / "frozen.pt")
    torch.jit.trace(module, torch.zeros(1, 5)).save(folder / "traced.pt")


def _checkpoint(folder: Path) -> None:
    normaliser = {"obs_normalizer._mean": torch.ones(1, 5), "obs_normalizer._std": torch.ones(1, 5)}
    content = {"actor_state_dict": state(**normaliser), "iter": 3, "infos": None}
    torch.save(content, folder / "zip.pt")
    torch.save(content, folder / "old.pt", _use_new_zipfile_serialization=False)


def _onnx(folder: Path) -> None:
    layers = nn.Sequential(nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3)).eval()
    for name, beside in (("whole", False), ("beside", True)):
        path, inputs = folder / f"{name}.onnx", (torch.zeros(1, 5),)
        torch.onnx.export(layers, inputs, path, external_data=beside, verbose=False)


def _description(folder: Path) -> None:
    (folder / "env.yaml").write_text(yaml.dump(ENVIRONMENT, sort_keys=False))


LOADERS = {
    "npz": Loader(_npz, walking_policy.load),
    "TorchScript": Loader(_torchscript, load_mlp),
    "checkpoint": Loader(_checkpoint, load_mlp),
    "ONNX": Loader(_onnx, load_mlp),
    "description": Loader(_description, described),
}
