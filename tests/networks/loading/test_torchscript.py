import zipfile

import pytest
import torch
from torch import nn

from spikeport.errors import UsageError
from spikeport.networks.loading.chain import Chain
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.torchscript import OPERATIONS

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
ACTIVATIONS = {"elu": nn.ELU, "relu": nn.ReLU, "tanh": nn.Tanh, "silu": nn.SiLU, "gelu": nn.GELU}
SHAPE = (1, 5)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.pt"


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_a_scripted_module_is_read(path, sequential, agrees, name):
    module = sequential(ACTIVATIONS[name])
    torch.jit.script(module).save(path)
    mlp = load_mlp(path)
    assert (mlp.sizes, mlp.activation) == ((5, 7, 6, 3), name)
    agrees(mlp, module)


def test_a_traced_module_in_training_mode_is_read(path, sequential, agrees):
    module = sequential(lambda: nn.ELU(inplace=True)).train()
    torch.jit.trace(module, torch.zeros(SHAPE)).save(path)
    agrees(load_mlp(path), module)


def test_a_frozen_module_is_read(path, sequential, agrees):
    module = sequential()
    torch.jit.freeze(torch.jit.script(module)).save(path)
    agrees(load_mlp(path), module)


SAVED = {
    "scripted": torch.jit.script,
    "traced": lambda module: torch.jit.trace(module, torch.zeros(SHAPE)),
    "frozen": lambda module: torch.jit.freeze(torch.jit.script(module)),
}


@pytest.mark.parametrize("form", SAVED)
def test_batch_normalisation_is_folded_and_dropout_is_left_out(path, normalised, agrees, form):
    module = normalised()
    SAVED[form](module).save(path)
    agrees(load_mlp(path), module)


@pytest.mark.parametrize("inplace", [False, True])
def test_dropout_in_place_is_left_out_too(path, sequential, agrees, inplace):
    module = sequential(lambda: nn.Sequential(nn.ELU(), nn.Dropout(inplace=inplace)))
    torch.jit.script(module).save(path)
    agrees(load_mlp(path), module)


def test_a_trace_of_dropout_in_training_is_refused_until_it_is_in_evaluation_mode(path):
    module = nn.Sequential(nn.Linear(5, 3), nn.ELU(), nn.Dropout(), nn.Linear(3, 2))
    torch.jit.trace(module, torch.zeros(SHAPE), check_trace=False).save(path)
    with pytest.raises(UsageError) as refused:
        load_mlp(path)
    assert str(refused.value).endswith(
        "expected a policy in evaluation mode, found dropout or batch normalisation in training "
        "mode; call eval() before the trace"
    )
    torch.jit.trace(module.eval(), torch.zeros(SHAPE)).save(path)
    load_mlp(path)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("aten::lt", [True, False, False]),
        ("aten::gt", [False, True, False]),
        ("aten::ne", [True, True, False]),
    ],
)
def test_numbers_can_be_compared_and_observations_cannot(name, expected):
    compare = OPERATIONS[name]
    assert [compare(*pair) for pair in ((0, 1), (1, 0), (1, 1))] == expected
    with pytest.raises(TypeError):
        compare(Chain(), 0)


def test_a_torchscript_export_of_rsl_rl_is_read_with_its_normalisation(path, actor, agrees):
    exported = torch.jit.script(actor.as_jit())
    exported.save(path)
    agrees(load_mlp(path), exported)


class Arithmetic(nn.Module):
    """Matrices and constants written out."""

    def __init__(self):
        super().__init__()
        self.W = nn.Parameter(torch.randn(5, 4))
        self.V = nn.Parameter(torch.randn(4, 3))

    def forward(self, x):
        hidden = torch.tanh(2.0 * torch.matmul(3.0 - x, self.W) + 1.0)
        return torch.addmm(torch.ones(3), hidden / 2.0, self.V, beta=0.5, alpha=2.0)


def test_arithmetic_is_folded_into_the_layers(path, agrees):
    module = Arithmetic()
    torch.jit.script(module).save(path)
    agrees(load_mlp(path), module)


class Bounded(nn.Module):
    """A policy that clips its normalised observation and its action, as rl_games' do."""

    def __init__(self, module):
        super().__init__()
        self.module = module
        self.register_buffer("mean", torch.randn(5))
        self.register_buffer("var", torch.rand(5) + 0.1)

    def forward(self, x):
        y = torch.clamp((x - self.mean) / torch.sqrt(self.var + 1e-5), -1.0, 1.0)
        return nn.functional.hardtanh(self.module(y).clamp_(min=-0.3), -0.5, 0.2)


@pytest.mark.parametrize("form", SAVED)
def test_clips_of_observation_and_action_are_read(path, sequential, agrees, form):
    module = Bounded(sequential()).eval()
    SAVED[form](module).save(path)
    agrees(load_mlp(path), module)


class ClippedBehindDropout(nn.Module):
    """Dropout in evaluation mode returns its own input, which the clip then changes in place."""

    def __init__(self, module):
        super().__init__()
        self.module = module

    def forward(self, x):
        y = nn.functional.dropout(x, 0.5, False)
        y.clamp_(-0.1, 0.1)
        return self.module(x)


def test_a_value_that_was_changed_under_another_name_is_refused(path, sequential, refusal):
    torch.jit.script(ClippedBehindDropout(sequential()).eval()).save(path)
    assert refusal(path).endswith("found a value that is used after it was changed in place")


@pytest.mark.parametrize("form", SAVED)
def test_tanh_behind_the_last_layer_is_read(path, sequential, agrees, form):
    module = nn.Sequential(nn.Flatten(), sequential(nn.ReLU), nn.Tanh()).eval()
    SAVED[form](module).save(path)
    mlp = load_mlp(path)
    assert (mlp.activation, mlp.squash.words) == ("relu", "tanh")
    agrees(mlp, module)


class Converted(nn.Module):
    """A policy around which types, devices and a constant tensor are converted."""

    def __init__(self, convert):
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3))
        self.convert = convert

    def forward(self, x):
        offset = torch.tensor([0.5, -1.0, 2.0])  # a trace converts it at each call
        return 0.25 * self.layers(self.convert(x)) + offset


@pytest.mark.parametrize(
    "convert",
    [
        torch.Tensor.float,
        lambda x: x.double().float(),
        lambda x: x.to("cpu"),
        lambda x: x.to("cpu", torch.float32, copy=True),
    ],
    ids=["float", "double", "device", "copy"],
)
def test_conversions_to_floats_and_devices_change_nothing(path, agrees, convert):
    module = Converted(convert)
    torch.jit.trace(module, torch.zeros(SHAPE)).save(path)
    agrees(load_mlp(path), module)


@pytest.mark.parametrize("convert", [torch.Tensor.half, torch.Tensor.int])
def test_conversions_that_round_are_refused(path, convert):
    module = Converted(lambda x: convert(x).float())
    torch.jit.trace(module, torch.zeros(SHAPE)).save(path)
    with pytest.raises(UsageError, match="operation aten::to with operands it does not take"):
        load_mlp(path)


class Skip(nn.Module):
    def __init__(self):
        super().__init__()
        self.layer = nn.Linear(5, 5)

    def forward(self, x):
        return x + self.layer(x)


class Two(nn.Module):
    def forward(self, x, y):
        return x + y


CHAIN = "expected a chain of dense layers and activations, found operation"


@pytest.mark.parametrize(
    ("module", "complaint"),
    [
        (nn.Sequential(nn.Linear(5, 3)), "expected at least one hidden layer, found none"),
        (
            nn.Sequential(nn.Linear(5, 3), nn.ELU(alpha=0.5), nn.Linear(3, 2)),
            "expected ELU with alpha 1, found 0.5",
        ),
        (
            nn.Sequential(nn.Linear(5, 3), nn.GELU("tanh"), nn.Linear(3, 2)),
            "expected activation elu or relu or tanh or silu or gelu, found gelu (tanh)",
        ),
        (
            nn.Sequential(nn.Linear(5, 3), nn.ELU(), nn.Linear(3, 3), nn.ReLU(), nn.Linear(3, 2)),
            "expected one activation for all hidden layers, found elu, relu",
        ),
        (
            nn.Sequential(nn.Linear(5, 3), nn.Tanh()),
            "expected at least one hidden layer, found none",
        ),
        (
            nn.Sequential(nn.Linear(5, 3), nn.ReLU(), nn.Linear(3, 2), nn.ReLU()),
            "expected a linear last layer, or tanh behind it, found relu at its end",
        ),
        (
            nn.Sequential(nn.Linear(5, 3), nn.ReLU6(), nn.Linear(3, 2)),
            "expected a clip of the observation or the action, found one between layers",
        ),
        (
            nn.Sequential(nn.Tanh(), nn.Linear(5, 3)),
            "expected a dense layer before every activation, found tanh without one",
        ),
        (nn.Identity(), "expected a linear last layer, or tanh behind it, found none"),
        (nn.Sequential(nn.Linear(5, 3), nn.Softplus()), f"{CHAIN} aten::softplus"),
        (nn.LayerNorm(5), f"{CHAIN} aten::layer_norm"),
        (nn.Flatten(0), "expected observations in rows, found flatten of axes 0 to -1"),
        (Skip(), f"{CHAIN} aten::add with operands it does not take"),
        (Two(), "expected a module with one input, the observation, found 2 inputs"),
    ],
)
def test_a_module_other_than_a_perceptron_is_refused(path, refusal, module, complaint):
    torch.jit.script(module).save(path)
    assert refusal(path) == complaint


def test_outputs_have_no_names(path, sequential):
    torch.jit.script(sequential()).save(path)
    with pytest.raises(UsageError) as refused:
        load_mlp(path, output="mu")
    assert str(refused.value).endswith(
        "expected an ONNX file, whose outputs have names, found TorchScript; leave out --output"
    )


def test_nan_is_refused(path, sequential, refusal):
    module = sequential()
    module[2].weight.data[0, 0] = torch.nan
    torch.jit.script(module).save(path)
    assert refusal(path) == "expected finite numbers, found NaN or infinity in layer 1"


def test_matrices_that_do_not_fit_are_refused(path, refusal):
    torch.jit.script(nn.Sequential(nn.Linear(5, 3), nn.Linear(4, 2))).save(path)
    assert refusal(path) == (
        "expected shapes that fit each other, found weights (2, 4), bias (2,), values (3,)"
    )


def test_a_damaged_file_is_refused(path, sequential, refusal, tmp_path):
    torch.jit.script(sequential()).save(tmp_path / "whole.pt")
    with zipfile.ZipFile(tmp_path / "whole.pt") as whole, zipfile.ZipFile(path, "w") as part:
        for name in whole.namelist():
            if not name.endswith("/data.pkl"):
                part.writestr(name, whole.read(name))
    assert refusal(path).startswith("expected a TorchScript module, found ")
