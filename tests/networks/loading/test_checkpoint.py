import numpy as np
import pytest
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel, RNNModel
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict
from torch import nn

from spikeport.errors import UsageError
from spikeport.networks.loading.files import load_mlp
from tests.helpers.foreign import state


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model_300.pt"


@pytest.fixture
def checkpoint(actor):
    """Return a file as rsl-rl's runner saves it."""
    seen = TensorDict({"policy": torch.zeros(4, 5)}, batch_size=4)
    critic = MLPModel(seen, {"critic": ["policy"]}, "critic", 1, (4,))
    storage = RolloutStorage("rl", 4, 8, seen, [3])
    return {**PPO(actor, critic, storage).save(), "iter": 300, "infos": None}


def older(checkpoint):
    """Return the file with the names of rsl-rl 3."""
    names = {"mlp.": "actor.", "obs_normalizer.": "actor_obs_normalizer."}
    state = {"std": torch.ones(3), "critic.0.weight": torch.ones(1, 1)}
    for name, value in checkpoint["actor_state_dict"].items():
        for now, before in names.items():
            if name.startswith(now):
                state[name.replace(now, before)] = value
    return {"model_state_dict": state, "optimizer_state_dict": {}, "iter": 300, "infos": None}


def oldest(checkpoint):
    """Return the file with the names of rsl-rl 2, which keeps the normalisation by itself."""
    content = older(checkpoint)
    state, start = content["model_state_dict"], "actor_obs_normalizer."
    apart = {name: state.pop(name) for name in list(state) if name.startswith(start)}
    apart = {name.removeprefix(start): value for name, value in apart.items()}
    return {**content, "obs_norm_state_dict": apart}


@pytest.mark.parametrize("version", [dict, older, oldest])
def test_the_actor_of_a_checkpoint_is_read(path, checkpoint, actor, agrees, version):
    torch.save(version(checkpoint), path)
    mlp = load_mlp(path)
    assert (mlp.sizes, mlp.activation) == ((5, 7, 6, 3), "elu")
    agrees(mlp, actor.as_jit())
    normalizer = actor.obs_normalizer
    np.testing.assert_array_equal(mlp.trained_on.mean, normalizer._mean.numpy()[0])
    np.testing.assert_array_equal(mlp.trained_on.std, normalizer._std.numpy()[0])


def test_a_checkpoint_without_normalisation_has_no_training_statistics(path):
    torch.save({"actor_state_dict": state()}, path)
    assert load_mlp(path).trained_on is None


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (("_mean", "_var", "count"), "_mean, _var, count"),
        (("running_mean", "running_var", "count"), "running_mean, running_var, count"),
        (("_std",), "_std"),
    ],
)
@pytest.mark.parametrize("version", [older, oldest])
def test_a_normalisation_with_other_names_is_refused(path, checkpoint, names, found, version):
    content = version(checkpoint)
    start = "actor_obs_normalizer."
    state = content["model_state_dict"]
    kept = {name: one for name, one in state.items() if not name.startswith(start)}
    values = dict.fromkeys(names, torch.ones(1, 5))
    if "obs_norm_state_dict" in content:
        content["obs_norm_state_dict"] = values
    else:
        kept |= {start + name: value for name, value in values.items()}
    torch.save({**content, "model_state_dict": kept}, path)
    message = f"expected a normalisation with _mean and _std, found {found}"
    with pytest.raises(UsageError, match=message):
        load_mlp(path)


def test_a_file_from_before_zip_archives_is_read(path, checkpoint, actor, agrees):
    torch.save(checkpoint, path, _use_new_zipfile_serialization=False)
    agrees(load_mlp(path), actor.as_jit())


def test_an_actor_without_normalisation_is_read(path, sequential, agrees):
    state = {f"actor.{name}": value for name, value in sequential().state_dict().items()}
    torch.save({"model_state_dict": {**state, "log_std": torch.zeros(3)}}, path)
    agrees(load_mlp(path), sequential())


def test_an_activation_passed_to_the_loader_is_used(path, checkpoint):
    torch.save(checkpoint, path)
    assert load_mlp(path, "tanh").activation == "tanh"


def test_a_recurrent_actor_is_refused(path, refusal):
    seen = TensorDict({"policy": torch.zeros(4, 5)}, batch_size=4)
    model = RNNModel(seen, {"actor": ["policy"]}, "actor", 3, (4,), rnn_hidden_dim=6)
    torch.save({"actor_state_dict": model.state_dict()}, path)
    assert refusal(path) == (
        "expected an actor of dense layers, mlp.N.weight, found rnn.rnn.weight_ih_l0"
    )


def test_an_actor_with_another_distribution_than_one_deviation_is_refused(path, refusal):
    seen = TensorDict({"policy": torch.zeros(4, 5)}, batch_size=4)
    kind = {"class_name": "HeteroscedasticGaussianDistribution", "init_std": 1.0}
    groups = {"actor": ["policy"]}
    model = MLPModel(seen, groups, "actor", 3, (4,), distribution_cfg=kind)
    torch.save({"actor_state_dict": model.state_dict()}, path)
    assert refusal(path) == (
        "expected a Gaussian action with one standard deviation, found another distribution"
    )


def test_layers_that_do_not_fit_are_refused(path, checkpoint, refusal):
    checkpoint["actor_state_dict"]["mlp.2.weight"] = torch.ones(6, 8)
    torch.save(checkpoint, path)
    assert refusal(path) == "expected weights of shape (6, 7) in layer 1, found (6, 8)"


def test_dense_layers_without_an_activation_between_them_are_refused(path, checkpoint, refusal):
    state = checkpoint["actor_state_dict"]
    for kind in ("weight", "bias"):
        state[f"mlp.3.{kind}"] = state.pop(f"mlp.4.{kind}")
    torch.save(checkpoint, path)
    assert refusal(path) == "expected an activation between two dense layers, found mlp.2 and 3"


def test_a_bias_that_does_not_fit_is_refused(path, checkpoint, refusal):
    checkpoint["actor_state_dict"]["mlp.2.bias"] = torch.ones(4)
    torch.save(checkpoint, path)
    assert refusal(path) == "expected mlp.2.bias of shape (6,), found (4,)"


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        (nn.LayerNorm, "expected a matrix mlp.1.weight of a dense layer, found shape (7,)"),
        (nn.BatchNorm1d, "expected an actor of dense layers, mlp.N.weight, found mlp.1.running_"),
    ],
)
def test_a_normalisation_between_layers_is_refused_by_its_key(path, checkpoint, kind, complaint):
    layer = {f"mlp.1.{name}": value for name, value in kind(7).state_dict().items()}
    checkpoint["actor_state_dict"].update(layer)
    torch.save(checkpoint, path)
    with pytest.raises(UsageError) as raised:
        load_mlp(path)
    assert complaint in str(raised.value)
    assert "; fold a batch normalisation into the dense layer before it; " in str(raised.value)


def test_a_normalisation_that_is_not_a_vector_is_refused(path, checkpoint, refusal):
    checkpoint["actor_state_dict"]["obs_normalizer._mean"] = torch.ones(5, 5)
    torch.save(checkpoint, path)
    assert refusal(path) == "expected a vector, found an array of shape (5, 5)"


@pytest.mark.parametrize("std", [np.inf, -1.0])
def test_an_infinite_or_negative_standard_deviation_is_refused(path, checkpoint, refusal, std):
    checkpoint["actor_state_dict"]["obs_normalizer._std"][0, 1] = std
    torch.save(checkpoint, path)
    assert refusal(path) == (
        "expected finite standard deviations from 0 on in the normalisation, found other values"
    )


def test_a_missing_bias_is_refused(path, checkpoint, refusal):
    del checkpoint["actor_state_dict"]["mlp.2.bias"]
    torch.save(checkpoint, path)
    assert refusal(path) == "expected mlp.2.bias, found none"


def test_objects_that_may_run_code_are_refused(path, refusal):
    torch.save({"actor_state_dict": {}, "infos": Unsafe()}, path)
    assert refusal(path) == (
        f"expected tensors and plain values, found {__name__}.Unsafe, which may run code"
    )
    assert not Unsafe.made


class Unsafe:
    made = False

    def __setstate__(self, state):
        Unsafe.made = True

    def __getstate__(self):
        return {"a": 1}


@pytest.mark.parametrize("what", ["a module", "its state"])
def test_files_that_torch_saves_by_default_are_refused_with_the_way_to_save_them(path, what):
    module = torch.nn.Sequential(torch.nn.Linear(2, 3), torch.nn.ELU(), torch.nn.Linear(3, 1))
    torch.save(module if what == "a module" else module.state_dict(), path)
    with pytest.raises(UsageError, match=r"; save the policy by torch\.jit\.trace\("):
        load_mlp(path)
    torch.jit.trace(module, torch.ones(1, 2)).save(path)
    assert load_mlp(path).sizes == (2, 3, 1)


STATES = "with actor_state_dict or model_state_dict"


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ({"weights": torch.ones(1)}, f"expected a checkpoint of rsl-rl {STATES}, found weights"),
        (torch.ones(2), "expected a checkpoint of rsl-rl, found Tensor"),
        (
            {"actor_state_dict": {"mlp.0.weight": 1}},
            "expected tensors in actor_state_dict, found other values",
        ),
        (
            {"model_state_dict": {"std": torch.ones(1)}},
            "expected a linear last layer, or tanh behind it, found none",
        ),
        (
            {"actor_state_dict": {}},
            "expected a Gaussian action with one standard deviation, found another distribution",
        ),
    ],
)
def test_content_that_is_not_a_checkpoint_is_refused(path, refusal, content, complaint):
    torch.save(content, path)
    assert refusal(path) == complaint


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"mlp.0.weight": torch.ones(4, 5).to_sparse()}, "_rebuild_sparse_tensor, which may run"),
        ({"mlp.0.weight": torch.ones(4, 5, device="meta")}, "_rebuild_meta_tensor_no_storage, wh"),
        ({"mlp.0.weight": torch.ones(4, 5, dtype=torch.complex64)}, "ComplexFloatStorage, which"),
        ({"mlp.0.weight": torch.ones(4, 5, dtype=torch.float8_e4m3fn)}, "which may run code"),
        ({"mlp.0.weight": np.ones((4, 5))}, "which may run code"),
        ({"mlp.00.weight": torch.ones(4, 5)}, "found mlp.00.weight"),
        ({"mlp.\x1b[2J": torch.ones(4, 5)}, r"found mlp.\x1b[2J"),
        ({"mlp.0.weight": torch.ones(4, 5, 6)}, "vectors and matrices"),
        ({"mlp.0.weight": torch.ones(0, 5), "mlp.0.bias": torch.ones(0)}, "0, found none"),
        ({"obs_normalizer._mean": torch.ones(3), "obs_normalizer._std": torch.ones(5)}, "normalis"),
        ({7: torch.ones(1)}, "found 7"),
    ],
)
def test_unsupported_tensors_of_a_checkpoint_are_refused(path, refused, changed, complaint):
    torch.save({"actor_state_dict": {**state(), **changed}}, path)
    assert complaint in refused(path)


def test_checkpoints_may_hold_parameters_and_numbers_of_half_precision(path, watched):
    halves = {
        "mlp.0.weight": torch.ones(4, 5, dtype=torch.bfloat16),
        "mlp.0.bias": torch.ones(4).half(),
    }
    parameters = {"mlp.2.weight": nn.Parameter(torch.ones(4, 3)).T, 1: nn.Parameter(torch.ones(1))}
    extra = {1: parameters.pop(1), "device": torch.device("cpu"), "size": torch.Size([1])}
    torch.save({"actor_state_dict": {**state(), **halves, **parameters}, "infos": extra}, path)
    watched(lambda: load_mlp(path))
    assert (load_mlp(path).layers[0].weights == 1).all()
