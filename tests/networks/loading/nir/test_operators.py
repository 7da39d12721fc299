"""Linear nodes as matrices, compared with torch."""

import numpy as np
import pytest
import torch

from spikeport.networks.loading.nir.graph import Node
from spikeport.networks.loading.nir.operators import operator
from spikeport.reading.mismatch import MismatchError

DT_S = 1e-3


def node(kind: str, **values) -> Node:
    return Node(
        "n", kind, {k: v if isinstance(v, str) else np.asarray(v) for k, v in values.items()}
    )


def applied(node: Node, x: np.ndarray) -> np.ndarray:
    found = operator(node, x.shape, DT_S)
    return (found.matrix @ x.ravel() + found.bias).reshape(found.shape)


@pytest.mark.parametrize(
    ("stride", "padding", "dilation", "groups"),
    [
        (1, 0, 1, 1),
        ([2, 1], [1, 2], 1, 2),
        (1, "same", 2, 1),
        (2, "valid", [1, 2], 4),
        (1, 2, 1, 1),
    ],
)
def test_convolutions_are_those_of_torch(stride, padding, dilation, groups):
    rng = np.random.default_rng(0)
    x, weight = rng.random((4, 9, 8)), rng.random((8, 4 // groups, 3, 2))
    bias = rng.random(8)
    made = node(
        "Conv2d", weight=weight, bias=bias, stride=stride, padding=padding, dilation=dilation,
        groups=groups,
    )  # fmt: skip
    wanted = torch.nn.functional.conv2d(
        *map(torch.from_numpy, (x, weight, bias)), stride, padding, dilation, groups
    )
    np.testing.assert_allclose(applied(made, x), wanted.numpy())


@pytest.mark.parametrize("shape", [(2, 3), (4, 2, 3)])
def test_weights_of_the_last_axis_are_those_of_torch(shape):
    rng = np.random.default_rng(0)
    x, weight, bias = rng.random(shape), rng.random((5, 3)), rng.random(5)
    wanted = torch.nn.functional.linear(*map(torch.from_numpy, (x, weight, bias)))
    np.testing.assert_allclose(applied(node("Affine", weight=weight, bias=bias), x), wanted.numpy())


def test_a_batch_axis_of_size_1_is_accepted():
    rng = np.random.default_rng(0)
    x, weight = rng.random((1, 2, 6, 6)), rng.random((4, 2, 3, 3))
    made = node("Conv2d", weight=weight, stride=1, padding=1, dilation=1, groups=1)
    wanted = torch.nn.functional.conv2d(*map(torch.from_numpy, (x, weight)), padding=1)
    np.testing.assert_allclose(applied(made, x), wanted.numpy())
    pool = node("AvgPool2d", kernel_size=2, stride=2, padding=0)
    np.testing.assert_allclose(applied(pool, x), torch.nn.AvgPool2d(2)(torch.from_numpy(x)))
    flat = node("Flatten", start_dim=1, end_dim=-1)
    assert applied(flat, x).shape == (1, 72)
    # start_dim counts a batch axis that is absent here
    assert applied(flat, x.ravel()).shape == (72,)


@pytest.mark.parametrize(("stride", "padding"), [(1, 0), (3, 2), (1, "same")])
def test_convolutions_of_one_axis_are_those_of_torch(stride, padding):
    rng = np.random.default_rng(0)
    x, weight, bias = rng.random((3, 20)), rng.random((5, 3, 4)), rng.random(5)
    made = node(
        "Conv1d", weight=weight, bias=bias, stride=stride, padding=padding, dilation=1, groups=1
    )
    wanted = torch.nn.functional.conv1d(*map(torch.from_numpy, (x, weight, bias)), stride, padding)
    np.testing.assert_allclose(applied(made, x), wanted.numpy())


def test_pools_are_those_of_torch():
    x = np.random.default_rng(0).random((3, 8, 7))
    values = {"kernel_size": [3, 2], "stride": [2, 1], "padding": [1, 0]}
    wanted = torch.nn.functional.avg_pool2d(torch.from_numpy(x), (3, 2), (2, 1), (1, 0)).numpy()
    np.testing.assert_allclose(applied(node("AvgPool2d", **values), x), wanted)
    np.testing.assert_allclose(applied(node("SumPool2d", **values), x), 6 * wanted)


def test_scale_flatten_linear_affine_and_delay_compute_what_nir_defines():
    x = np.arange(6.0).reshape(2, 3)
    np.testing.assert_array_equal(applied(node("Scale", scale=2 * x), x), 2 * x**2)
    np.testing.assert_array_equal(applied(node("Scale", scale=3), x), 3 * x)
    np.testing.assert_array_equal(applied(node("Scale", scale=[[2], [5]]), x), x * [[2], [5]])
    assert applied(node("Flatten", start_dim=-2, end_dim=-1), x[np.newaxis]).shape == (1, 6)
    flat = applied(node("Flatten", start_dim=0, end_dim=-1), x)
    np.testing.assert_array_equal(flat, np.arange(6))
    weight, bias = np.arange(12.0).reshape(2, 6), np.array([1.0, 2])
    wanted = weight @ x.ravel()
    np.testing.assert_array_equal(applied(node("Linear", weight=weight), x), wanted)
    np.testing.assert_array_equal(
        applied(node("Affine", weight=weight, bias=bias), x), wanted + bias
    )
    np.testing.assert_array_equal(applied(node("Delay", delay=np.full(6, DT_S)), x), x)
    for n_steps in (0, 1):
        delay = node("Delay", delay=np.full(6, n_steps * DT_S))
        assert operator(delay, x.shape, DT_S).n_steps == n_steps


CONV = {"weight": np.ones((2, 1, 3, 3)), "bias": np.zeros(2), "stride": 1, "dilation": 1}
WHOLE = {**CONV, "padding": 0, "groups": 1}
MOST_WEIGHTS = "expected at most 8,388,608 weights in node n, found "


@pytest.mark.parametrize(
    ("made", "shape", "message"),
    [
        (node("Linear", weight=np.ones((2, 3))), (4,), "expected 3 values into node n, found (4"),
        (node("Linear", weight=np.ones(3)), (3,), "expected a weight of 2 axes in node n, found 1"),
        (node("Affine", weight=np.eye(2), bias=[1]), (2,), "expected 2 biases in node n, found 1"),
        (node("Scale", scale=[1, 2]), (3,), "expected scale for (3,) in node n, found (2,)"),
        (node("Scale", scale=np.ones((2, 3))), (3, 2), "expected scale for (3, 2) in node n, fo"),
        (node("Delay", delay=[0.002]), (1,), "expected node n to delay by 0 or 0.001 s, the step"),
        (node("Delay", delay=[0, DT_S]), (2,), "expected node n to delay all values alike, fo"),
        (node("Flatten", start_dim=2, end_dim=3), (3,), "expected axes of (3,) to flatten in node"),
        (node("Flatten", start_dim=-2, end_dim=0), (3,), "expected start_dim from -1 to 1,048,576"),
        (
            node("Flatten", start_dim=[0, 1], end_dim=1),
            (3,),
            "expected one number for start_dim in node n, found 2",
        ),
        (
            node("Conv2d", **{**WHOLE, "groups": [1, 1]}),
            (1, 9, 9),
            "expected one number for groups in node n, found 2",
        ),
        (node("Linear", weight=np.ones((0, 3))), (3,), "expected from 1 to 1,048,576 values after"),
        (node("Conv2d", **WHOLE), (1, 9), "expected channels and 2 axes of space into node n, fo"),
        (node("Conv2d", **WHOLE), (2, 1, 9, 9), "expected channels and 2 axes of space into nod"),
        (node("Conv2d", **WHOLE), (2, 9, 9), "expected 2 channels in node n, found 1 groups of 1"),
        (node("Conv2d", **WHOLE), (1, 2, 9), "expected a kernel within (2, 9) in node n, found (3"),
        (node("Conv2d", **WHOLE), (1, 2000, 2000), f"{MOST_WEIGHTS}71,856,072"),
        (node("Linear", weight=np.ones((3000, 3000))), (3000,), f"{MOST_WEIGHTS}9,000,000"),
        (node("Linear", weight=np.ones((300, 300))), (100, 300), f"{MOST_WEIGHTS}9,000,000"),
        (
            node("Conv2d", **{**WHOLE, "stride": 0}),
            (1, 9, 9),
            "expected stride with a number from 1 on for each axis in node n, found (0,)",
        ),
        (
            node("Conv2d", **{**WHOLE, "stride": [1, 2], "padding": "same"}),
            (1, 9, 9),
            "expected a stride of 1 with padding same in node n, found (1, 2)",
        ),
        (
            node("Conv2d", **WHOLE, input_shape=[8, 9]),
            (1, 9, 8),
            "expected input_shape (9, 8) in node n, as the nodes before it have it, found (8, 9)",
        ),
        (node("Conv2d", **CONV, groups=1, padding="all"), (1, 9, 9), "expected padding same or v"),
        (node("SumPool2d", kernel_size=2, stride=2, padding=0), (9,), "expected channels and"),
        (node("SumPool2d", kernel_size=2**12, stride=1, padding=0), (1, 9, 9), f"{MOST_WEIGHTS}16"),
    ],
)  # fmt: skip
def test_shapes_that_do_not_fit_are_refused(made, shape, message):
    with pytest.raises(MismatchError) as caught:
        operator(made, shape, DT_S)
    assert str(caught.value).startswith(message)


def test_the_input_shape_of_a_convolution_may_be_stated_or_absent():
    line = {**CONV, "weight": np.ones((2, 1, 3)), "padding": 0, "groups": 1}
    for made, shape in (
        (node("Conv2d", **WHOLE, input_shape=[9, 8]), (1, 9, 8)),
        (node("Conv2d", **WHOLE), (1, 9, 8)),
        (node("Conv1d", **line, input_shape=9), (1, 9)),
    ):
        assert operator(made, shape, DT_S).shape[0] == 2


def test_a_diagonal_matrix_that_is_too_large_is_small_enough_as_a_scale():
    with pytest.raises(MismatchError) as caught:
        operator(node("Linear", weight=np.eye(3000)), (3000,), DT_S)
    assert "make it a Scale" in str(caught.value.cure)
    assert operator(node("Scale", scale=np.ones(3000)), (3000,), DT_S).matrix.nnz == 3000


def test_a_pool_over_all_places_has_one_weight_for_each_place():
    pool = node("AvgPool2d", kernel_size=64, stride=64, padding=0)
    assert operator(pool, (1, 64, 64), DT_S).matrix.nnz == 64 * 64
