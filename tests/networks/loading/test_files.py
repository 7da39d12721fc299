import sys
import zipfile

import numpy as np
import pytest
import torch

from spikeport.errors import MissingExtraError, UsageError
from spikeport.networks import walking_policy
from spikeport.networks.loading import isaac
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.policy_values import exact
from spikeport.networks.walking_policy import WalkingPolicy

FORMATS = "expected npz or TorchScript or checkpoint or ONNX, found"


def test_our_own_file_is_read_as_layers():
    policy, x = walking_policy.load(), np.linspace(-1, 1, 69)
    mlp = load_mlp(walking_policy.SHIPPED)
    assert mlp.sizes == (69, 128, 128, 128, 19)
    np.testing.assert_allclose(exact(mlp.layers, x, mlp.activation)[-1], policy(x))


def test_a_text_is_refused(tmp_path, refusal):
    path = tmp_path / "policy.pt"
    path.write_text("not a policy")
    assert refusal(path) == f"{FORMATS} none of them"


def test_another_archive_is_refused(tmp_path, refusal):
    path = tmp_path / "policy.pt"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "not a policy")
    assert refusal(path) == f"{FORMATS} another zip archive"


def test_an_npz_of_other_arrays_is_refused(tmp_path):
    path = tmp_path / "policy.npz"
    np.savez(path, x=np.zeros(2))
    with pytest.raises(UsageError, match=r"expected weights, biases and joints, .* arrays missing"):
        load_mlp(path)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ((3, 2), "at least one hidden layer, found none"),
        ((3, 0, 2), "units in layer 0, found none"),
    ],
)
def test_our_own_file_has_a_hidden_layer_with_units(tmp_path, sizes, message):
    weights = [np.ones(shape) for shape in zip(sizes[1:], sizes[:-1], strict=True)]
    biases = [np.ones(len(one)) for one in weights]
    policy = WalkingPolicy(tuple(weights), tuple(biases), ("hip", "knee"), np.zeros(2), 0.5)
    policy.save(tmp_path / "policy.npz")
    with pytest.raises(UsageError, match=f"expected {message}"):
        load_mlp(tmp_path / "policy.npz")


@pytest.mark.slow
def test_policies_are_read_without_the_packages_that_wrote_them(
    tmp_path, monkeypatch, sequential, agrees
):
    module = sequential()
    torch.jit.script(module).save(tmp_path / "policy.pt")
    state = {f"actor.{name}": value for name, value in module.state_dict().items()}
    torch.save({"model_state_dict": {**state, "std": torch.zeros(3)}}, tmp_path / "model.pt")
    torch.onnx.export(module, (torch.zeros(1, 5),), tmp_path / "policy.onnx")
    with monkeypatch.context() as without:
        for package in ("torch", "onnx"):
            without.setitem(sys.modules, package, None)
        read = [load_mlp(tmp_path / name) for name in ("policy.pt", "model.pt", "policy.onnx")]
    for mlp in read:
        agrees(mlp, module)


def test_an_absent_yaml_package_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "env.yaml").touch()
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(MissingExtraError) as error:
        isaac.described(tmp_path / "env.yaml")
    assert str(error.value) == (
        "reading this file needs the package yaml, which is absent; "
        "install it with: pip install 'spikeport[convert]'"
    )
