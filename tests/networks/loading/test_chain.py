"""A chain of layers, put together from operations one by one."""

import numpy as np
import pytest

from spikeport.networks.loading.chain import BoundedEvaluation, Chain
from spikeport.reading.mismatch import MismatchError

W = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
V = np.array([[1.0, 0.0, -1.0]])


def test_arithmetic_before_and_after_a_matrix_is_folded_into_it() -> None:
    chain = ((Chain() - np.array([1.0, 2.0])) / np.array([2.0, 4.0])).dense(W, np.ones(3)) * 10.0
    mlp = chain.activated("elu").dense(V).mlp()
    x = np.array([5.0, 6.0])
    wanted = 10 * (W @ ((x - [1, 2]) / [2, 4]) + 1)
    first, last = mlp.layers
    np.testing.assert_allclose(first.weights @ x + first.bias, wanted)
    assert (last.weights.tolist(), last.bias.tolist()) == (V.tolist(), [0])
    assert (mlp.activation, mlp.sizes) == ("elu", (2, 3, 1))


def test_matrices_without_an_activation_between_are_one_layer() -> None:
    mlp = Chain().dense(W).activated("relu").dense(np.eye(3), np.ones(3)).dense(V).mlp()
    assert len(mlp.layers) == 2
    assert mlp.layers[1].weights.tolist() == V.tolist()
    assert mlp.layers[1].bias.tolist() == [0]  # 1 - 1


def test_a_chain_can_be_subtracted_from_numbers() -> None:
    chain = 3.0 - Chain().dense(W)
    assert chain.matrix.tolist() == (-W).tolist()
    assert chain.constant.tolist() == [3, 3, 3]


def test_clips_around_the_layers_are_kept() -> None:
    """Compute them step by step, as the operations of a file do."""
    mean, std, scale = np.array([1.0, -2.0]), np.array([2.0, 0.5]), np.array([3.0, -1.0, 0.5])
    clipped = ((Chain() - mean) / std).clipped(-1, 1).clipped(None, [[0.5, 1.0]])
    hidden = (2.0 - clipped).dense(W).activated("relu")
    mlp = (scale * hidden.dense(np.eye(3), np.ones(3)).clipped([0.0, 5.0, 1.0], 8) + 1.0).mlp()
    for x in (np.array([9.0, 9.0]), np.array([-9.0, -9.0]), np.array([1.5, -2.2])):
        normal = np.minimum(np.clip((x - mean) / std, -1, 1), [0.5, 1.0])
        action = np.maximum(W @ (2 - normal), 0) + 1
        wanted = scale * np.clip(action, [0.0, 5.0, 1.0], 8) + 1
        np.testing.assert_allclose(mlp.exact(x)[-1], wanted)
    assert mlp.squash.words == "clip"


def test_limits_pass_through_tanh() -> None:
    mlp = (
        Chain().dense(W).activated("relu").dense(0.1 * V).clipped(-0.4, 0.2).activated("tanh").mlp()
    )
    for x in (np.array([0.5, -0.3]), np.array([5.0, 3.0]), np.array([-1.0, 2.0])):
        wanted = np.tanh(np.clip(0.1 * V @ np.maximum(W @ x, 0), -0.4, 0.2))
        np.testing.assert_allclose(mlp.exact(x)[-1], wanted)


def test_tanh_behind_the_last_layer_is_kept_with_its_scale() -> None:
    hidden = Chain().dense(W).activated("relu")
    mlp = (hidden.dense(0.1 * V).activated("tanh") * 2.0 - 1.0).mlp()
    x = np.array([0.5, -0.3])
    wanted = 2 * np.tanh(0.1 * V @ np.maximum(W @ x, 0)) - 1
    np.testing.assert_allclose(mlp.exact(x)[-1], wanted)
    assert (len(mlp.layers), mlp.activation, mlp.squash.words) == (2, "relu", "tanh")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chain().activated("elu"), "expected a dense layer before every activation"),
        (lambda: Chain().mlp(), "expected a linear last layer, or tanh behind it, found none"),
        (
            lambda: Chain().dense(W).activated("elu").mlp(),
            "expected a linear last layer, or tanh behind it, found elu at its end",
        ),
        (
            lambda: Chain().dense(W).clipped(0, 6).dense(V),
            "expected a clip of the observation or the action, found one between layers",
        ),
        (
            lambda: Chain().dense(W).clipped(0, 6).activated("elu"),
            "expected a clip of the observation or the action, found one between layers",
        ),
        (
            lambda: Chain().clipped(1, [0.0, 2.0]),
            "expected a lower limit of a clip that is not above its upper one, found another",
        ),
        (
            lambda: Chain().dense(W).activated("elu").dense(V).clipped([0.0, 1.0], 2).mlp(),
            "expected operations around the layers on 1 values, found an array of shape (2,)",
        ),
        (
            lambda: Chain().clipped(np.inf, None).dense(W).activated("elu").dense(V).mlp(),
            "expected limits of a clip that are numbers, found NaN or infinity",
        ),
        (
            lambda: Chain().dense(W).dense(np.eye(2)),
            "expected shapes that fit each other, found weights (2, 2), bias None, values (3,)",
        ),
    ],
)
def test_operations_that_make_no_chain_of_layers_are_refused(make, message: str) -> None:
    with pytest.raises(MismatchError) as caught:
        make()
    assert str(caught.value).startswith(message)


def test_two_chains_have_no_sum() -> None:
    with pytest.raises(TypeError):
        Chain() + Chain()


def test_arguments_by_name_are_as_bounded_as_arguments_by_position() -> None:
    evaluation = BoundedEvaluation({"add": lambda a, other: a + other})
    row, column = np.ones(10**5), np.ones((10**5, 1))
    for inputs, options in (((row, column), {}), ((row,), {"other": column})):
        with pytest.raises(MismatchError, match=r"at most [0-9,]+ (numbers|mult)"):
            evaluation.apply("add", *inputs, **options)
