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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chain().activated("elu"), "expected a dense layer before every activation"),
        (lambda: Chain().mlp(), "expected a linear last layer, found none"),
        (
            lambda: Chain().dense(W).activated("elu").mlp(),
            "expected a linear last layer, found elu at its end",
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
