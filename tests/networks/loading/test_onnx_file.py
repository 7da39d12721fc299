import numpy as np
import onnx
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper

from spikeport.networks.loading.files import load_mlp

RNG = np.random.default_rng(5)
W, V = RNG.standard_normal((4, 2)), RNG.standard_normal((3, 4))
MEAN, B = np.array([[1.0, 2.0]]), RNG.standard_normal(4)
CONSTANTS = {"W": W, "V": V, "B": B, "MEAN": MEAN, "HALF": np.array(0.5)}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.onnx"


def save(path, nodes, inputs, output, constants):
    floats = {"elem_type": TensorProto.FLOAT, "shape": ["n", None]}
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(name, **floats) for name in inputs],
        [helper.make_tensor_value_info(output, **floats)],
        [numpy_helper.from_array(a.astype(np.float32), name) for name, a in constants.items()],
    )
    opset = [helper.make_opsetid("", 20)]
    onnx.save(helper.make_model(graph, opset_imports=opset, ir_version=10), path)


@pytest.fixture
def write(path):
    """Write nodes (operation, inputs, options) in a row; each may read the one before as x."""

    def rows(*nodes, inputs=("x",)):
        made, last = [], "x"
        for number, (kind, names, options) in enumerate(nodes):
            names = [last if name == "x" else name for name in names]
            last = f"y{number}"
            made.append(helper.make_node(kind, names, [last], **options))
        save(path, made, inputs, last, CONSTANTS)

    return rows


HIDDEN = ("Gemm", ("x", "W", "B"), {"transB": 1})
LAST = ("Gemm", ("x", "V"), {"transB": 1, "alpha": 2.0})


@pytest.mark.parametrize(
    ("operation", "name"),
    [("Elu", "elu"), ("Relu", "relu"), ("Tanh", "tanh"), ("Gelu", "gelu")],
)
def test_normalisation_gemm_and_activation_are_read(write, path, operation, name):
    normalise = [("Sub", ("x", "MEAN"), {}), ("Div", ("x", "HALF"), {})]
    write(*normalise, HIDDEN, (operation, ("x",), {}), LAST)
    mlp = load_mlp(path)
    assert (mlp.sizes, mlp.activation) == ((2, 4, 3), name)
    np.testing.assert_allclose(mlp.layers[0].weights, 2 * W, rtol=1e-6)
    np.testing.assert_allclose(mlp.layers[0].bias, B - 2 * W @ MEAN[0], rtol=1e-6)
    np.testing.assert_allclose(mlp.layers[1].weights, 2 * V, rtol=1e-6)
    np.testing.assert_allclose(mlp.layers[1].bias, np.zeros(3))


def test_constants_may_stand_in_nodes_and_before_the_signal(path):
    def node(kind, names, name, **options):
        return helper.make_node(kind, names, [name], **options)

    nodes = [
        node("Constant", [], "WT", value=numpy_helper.from_array(W.T.astype(np.float32))),
        node("MatMul", ["x", "WT"], "z"),
        node("Elu", ["z"], "h"),
        node("Identity", ["h"], "g"),
        node("MatMul", ["g", "V"], "v"),
        node("Mul", ["two", "v"], "w"),
        node("Neg", ["w"], "y"),
    ]
    constants = {"V": V.T, "two": np.array(2.0)}
    save(path, nodes, ["x"], "y", constants)
    mlp = load_mlp(path)
    np.testing.assert_allclose(mlp.layers[0].weights, W, rtol=1e-6)
    np.testing.assert_allclose(mlp.layers[1].weights, -2 * V, rtol=1e-6)


def test_what_rsl_rl_exports_is_read(path, actor, agrees):
    module = actor.as_onnx(verbose=False).eval()
    torch.onnx.export(
        module, module.get_dummy_inputs(), path, input_names=["obs"], output_names=["actions"]
    )
    agrees(load_mlp(path), module)


CHAIN = "expected a chain of dense layers and activations, found operation"


@pytest.mark.parametrize(
    ("nodes", "complaint"),
    [
        ([HIDDEN, ("Sigmoid", ("x",), {}), LAST], f"{CHAIN} Sigmoid"),
        ([("Add", ("x", "x"), {})], f"{CHAIN} Add of other values"),
        ([HIDDEN, ("Elu", ("x",), {"alpha": 2.0}), LAST], "expected ELU with alpha 1, found 2"),
        (
            [HIDDEN, ("Gelu", ("x",), {"approximate": "tanh"}), LAST],
            "expected activation elu or relu or tanh or silu or gelu, found gelu (tanh)",
        ),
        (
            [("Gemm", ("x", "W"), {"transA": 1, "transB": 1})],
            "expected observations in rows, found Gemm with transA",
        ),
        (
            [("Add", ("B", "B"), {})],
            "expected one output that depends on the observation, found 1 outputs",
        ),
    ],
)
def test_another_graph_is_refused(write, path, refusal, nodes, complaint):
    write(*nodes)
    assert refusal(path) == complaint


def test_two_inputs_are_refused(write, path, refusal):
    write(HIDDEN, inputs=("x", "z"))
    assert refusal(path) == "expected one input and one output, found 2 inputs, 1 outputs"


def test_another_file_is_refused(path, refusal):
    path.write_text("no model")
    assert refusal(path).startswith("expected an ONNX model, found ")
