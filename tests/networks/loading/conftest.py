"""Files of policies, written by the libraries that users write them with."""

import copy
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
import yaml
from onnx import TensorProto, helper, numpy_helper
from rsl_rl.models import MLPModel
from tensordict import TensorDict
from torch import nn

from spikeport.errors import UsageError
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.refusal import CURE, SAVE
from tests.helpers.foreign import ENVIRONMENT, Policy, members
from tests.helpers.watch import harm_of

SIZES = (5, 7, 6, 3)
CURES = tuple(f"; {cure}" for cure in (CURE, SAVE))


@pytest.fixture
def observations() -> np.ndarray:
    return np.random.default_rng(3).standard_normal((20, SIZES[0]))


@pytest.fixture
def agrees(observations) -> Callable[[Mlp, nn.Module], None]:
    """Assert that layers compute what a module does."""

    def check(mlp: Mlp, module: nn.Module) -> None:
        with torch.no_grad():
            wanted = module(torch.tensor(observations, dtype=torch.float)).numpy()
        found = mlp.exact(observations)[-1]
        np.testing.assert_allclose(found, wanted, rtol=1e-4, atol=1e-5)
        assert np.abs(wanted).max() > 0.1

    return check


@pytest.fixture
def sequential() -> Callable[..., nn.Sequential]:
    """Return a module of dense layers with an activation between them."""

    def make(activation: Callable[[], nn.Module] = nn.ELU) -> nn.Sequential:
        torch.manual_seed(0)
        n, first, second, m = SIZES
        hidden = [nn.Linear(n, first), activation(), nn.Linear(first, second), activation()]
        return nn.Sequential(*hidden, nn.Linear(second, m)).eval()

    return make


@pytest.fixture
def normalised(sequential) -> Callable[[], nn.Sequential]:
    """Return a module with batch normalisation before and after an activation, and dropout."""

    def make() -> nn.Sequential:
        first, activation, *others = sequential()
        module = nn.Sequential(
            first,
            nn.BatchNorm1d(SIZES[1]),
            activation,
            nn.Dropout(0.5),
            nn.BatchNorm1d(SIZES[1], affine=False),
            *others,
        )
        for part in module:
            if isinstance(part, nn.BatchNorm1d):
                part.running_mean, part.running_var = torch.randn(SIZES[1]), torch.rand(SIZES[1])
        nn.init.normal_(module[1].weight)
        nn.init.normal_(module[1].bias)
        return module.eval()

    return make


@pytest.fixture
def actor() -> MLPModel:
    """Return rsl-rl's actor, with a normalizer from some observations."""
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
    """Return the refusal of a file by `load_mlp`, without the file's name and the cure."""

    def message(path: Path) -> str:
        with pytest.raises(UsageError) as error:
            load_mlp(path)
        before, _, text = str(error.value).partition(": ")
        assert before == f"policy file '{path}'"
        (cure,) = (cure for cure in CURES if text.endswith(cure))
        return text.removesuffix(cure)

    return message


@pytest.fixture
def environment(tmp_path) -> Callable[..., Path]:
    """Write Isaac Lab's description of the H1; changes are by place, as ``{"sim/dt": 0.01}``."""

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
    """Return a walking policy of few units."""
    torch.manual_seed(4)
    layers = [nn.Linear(69, 8), nn.ELU(), nn.Linear(8, 8), nn.ELU(), nn.Linear(8, 19)]
    return nn.Sequential(*layers).double().eval()


@pytest.fixture
def path(tmp_path, module) -> Path:
    """Return the file of the policy `module`."""
    torch.jit.script(module).save(tmp_path / "policy.pt")
    return tmp_path / "policy.pt"


SECONDS, BYTES = 10, 2**30
"""The most CPU time and memory that reading a file may take."""


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], object]], None]:
    """Call a function and assert that it does no harm: torch, Python's audit, time and memory."""

    def never(*_: object, **__: object) -> None:
        raise AssertionError("torch reads the file")

    def call(function: Callable[[], object]) -> None:
        with monkeypatch.context() as without:
            without.setattr(torch.jit, "load", never)
            without.setattr(torch, "load", never)
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            start = time.process_time()
            assert harm_of(function) == []
        assert time.process_time() - start < SECONDS
        assert 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < BYTES

    return call


@pytest.fixture
def refused(watched: Callable[..., None]) -> Callable[..., str]:
    """Return the complaint of a file that is refused, without its name."""

    def message(path: Path, load: Callable[[Path], object] = load_mlp) -> str:
        with pytest.raises(UsageError) as error:
            watched(lambda: load(path))
        start, _, text = str(error.value).partition("': ")
        assert start == f"policy file '{path}"
        assert str(error.value).isprintable()
        return text

    return message


@pytest.fixture
def scripted(path) -> dict[str, bytes]:
    """Return the members of a policy's file."""
    torch.jit.script(Policy()).save(path)
    return members(path)


@pytest.fixture
def model(tmp_path) -> Callable[..., Path]:
    """Write a model of two layers, changed by a function before it is written."""

    def write(change: Callable[[onnx.ModelProto], object] = lambda model: None) -> Path:
        rng = np.random.default_rng(0)
        weights = {"W": (4, 5), "b": (4,), "V": (3, 4)}
        graph = helper.make_graph(
            [
                helper.make_node("Gemm", ["x", "W", "b"], ["z"], transB=1),
                helper.make_node("Elu", ["z"], ["h"]),
                helper.make_node("Gemm", ["h", "V"], ["y"], transB=1),
            ],
            "policy",
            [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", 5])],
            [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["n", 3])],
            [
                numpy_helper.from_array(rng.standard_normal(shape).astype(np.float32), name)
                for name, shape in weights.items()
            ],
        )
        made = helper.make_model(graph)
        change(made)
        (tmp_path / "policy.onnx").write_bytes(made.SerializeToString())
        return tmp_path / "policy.onnx"

    return write
