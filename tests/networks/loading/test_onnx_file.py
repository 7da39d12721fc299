from collections.abc import Callable
from itertools import pairwise

import numpy as np
import onnx
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper

from spikeport.errors import UsageError
from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.onnx_file import NAME_IT
from spikeport.networks.loading.refusal import CURE
from spikeport.networks.policy_values import exact

RNG = np.random.default_rng(5)
W, V = RNG.standard_normal((4, 2)), RNG.standard_normal((3, 4))
MEAN, B = np.array([[1.0, 2.0]]), RNG.standard_normal(4)
NUMBERS = {"HALF": np.array(0.5), "QUARTER": np.array(0.25), "ONE": np.array(1.0)}
NUMBERS |= {"ROOT": np.sqrt(2), "YES": np.array(True), "NO": np.array(False)}
CONSTANTS = {"W": W, "V": V, "B": B, "MEAN": MEAN, **NUMBERS}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.onnx"


def _stored(array):
    array = np.asarray(array)
    return array if array.dtype == bool else array.astype(np.float32)


def save(path, nodes, inputs, outputs, constants):
    floats = {"elem_type": TensorProto.FLOAT, "shape": ["n", None]}
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(name, **floats) for name in inputs],
        [helper.make_tensor_value_info(name, **floats) for name in outputs],
        [numpy_helper.from_array(_stored(a), name) for name, a in constants.items()],
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
        save(path, made, inputs, [last], CONSTANTS)

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


@pytest.mark.parametrize(
    ("limits", "options", "wanted"),
    [
        (("QUARTER", "HALF"), {}, [0.25, 0.5]),
        (("", "HALF"), {}, [-9, 0.5]),
        (("QUARTER",), {}, [0.25, 9]),
        ((), {"min": 0.25, "max": 0.5}, [0.25, 0.5]),  # before opset 11
    ],
)
def test_clips_and_tanh_around_the_layers_are_read(write, path, limits, options, wanted):
    layers = [("Flatten", ("x",), {}), HIDDEN, ("Elu", ("x",), {}), LAST]
    write(("Clip", ("x", *limits), options), *layers, ("Tanh", ("x",), {}))
    x = np.array([-9.0, 9.0])
    mlp, inside = load_mlp(path), np.clip(x, *wanted)
    np.testing.assert_array_equal(mlp.clipped(x), inside)
    *_, z = exact(mlp.layers, inside)
    np.testing.assert_array_equal(mlp.exact(x)[-1], np.tanh(z))


DIVIDED, ERF = ("Div", ("x", "ROOT"), {}), ("Erf", ("x",), {})
PLUS, HALF = ("Add", ("x", "ONE"), {}), ("Mul", ("x", "HALF"), {})


@pytest.mark.parametrize(
    "parts",
    [
        (DIVIDED, ERF, PLUS, ("Mul", ("y0", "x"), {}), HALF),  # torch's exporter
        (DIVIDED, ERF, PLUS, HALF, ("Mul", ("x", "y0"), {})),
        (HALF, ("Div", ("y0", "ROOT"), {}), ERF, PLUS, ("Mul", ("y1", "x"), {})),
    ],
)
def test_gelu_may_be_written_in_parts_as_below_opset_20(write, path, parts):
    write(HIDDEN, ("Gelu", ("x",), {}), LAST)
    whole = load_mlp(path)
    write(HIDDEN, *parts, LAST)
    mlp = load_mlp(path)
    assert mlp.activation == whole.activation == "gelu"
    for one, other in zip(mlp.layers, whole.layers, strict=True):
        np.testing.assert_allclose(one.weights, other.weights, rtol=1e-6)
        np.testing.assert_allclose(one.bias, other.bias, rtol=1e-6)


def test_a_product_of_two_activations_or_clips_is_no_gelu(path, refusal):
    """The factors have the same weights: only their inputs differ."""
    half = [("Mul", ["e1", "v"], "m"), ("Mul", ["m", "HALF"], "g"), ("Gemm", ["g", "V"], "y")]
    parts = [("Div", ["u", "ROOT"], "d"), ("Erf", ["d"], "e0"), ("Add", ["e0", "ONE"], "e1"), *half]
    square = {"S": np.eye(4), **CONSTANTS}
    two = {
        "activations": [
            ("Gemm", ["x", "W", "B"], "h"),
            *(("Relu", ["h"], "r"), ("Tanh", ["h"], "t")),
            *(("Gemm", ["r", "S"], "u"), ("Gemm", ["t", "S"], "v")),
        ],
        "clips": [
            ("Clip", ["x", "HALF"], "c"),
            *(("Gemm", ["c", "W"], "u"), ("Gemm", ["x", "W"], "v")),
        ],
    }
    for nodes in two.values():
        made = [
            helper.make_node(kind, names, [out], **({"transB": 1} if kind == "Gemm" else {}))
            for kind, names, out in (*nodes, *parts)
        ]
        save(path, made, ["x"], ["y"], square)
        assert refusal(path) == f"{CHAIN} Erf"


@pytest.mark.parametrize(
    "options", [((), {}), (("HALF",), {}), (("HALF", "NO"), {}), ((), {"seed": 3})]
)
def test_dropout_and_the_usual_swish_are_read(write, path, options):
    names, chosen = options
    dropout = ("Dropout", ("x", *names), chosen)
    write(HIDDEN, dropout, ("Swish", ("x",), {"alpha": 1.0}), dropout, LAST)
    assert load_mlp(path).activation == "silu"


@pytest.mark.parametrize("factors", [("x", "y0"), ("y0", "x")])
def test_silu_may_be_the_product_of_a_value_and_its_sigmoid(write, path, factors):
    write(HIDDEN, ("Sigmoid", ("x",), {}), ("Mul", factors, {}), LAST)
    mlp = load_mlp(path)
    assert (mlp.sizes, mlp.activation) == ((2, 4, 3), "silu")


def test_constants_may_be_nodes_and_first_operands(path):
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
    save(path, nodes, ["x"], ["y"], constants)
    mlp = load_mlp(path)
    np.testing.assert_allclose(mlp.layers[0].weights, W, rtol=1e-6)
    np.testing.assert_allclose(mlp.layers[1].weights, -2 * V, rtol=1e-6)


@pytest.mark.parametrize("to", [onnx.TensorProto.FLOAT, onnx.TensorProto.DOUBLE])
def test_observations_may_be_cast_to_other_floats(write, path, to):
    write(("Cast", ("x",), {"to": to}), HIDDEN, ("Elu", ("x",), {}), LAST)
    np.testing.assert_allclose(load_mlp(path).layers[0].weights, W, rtol=1e-6)


@pytest.mark.parametrize("to", [onnx.TensorProto.FLOAT16, onnx.TensorProto.INT32])
def test_casts_that_round_are_refused(write, path, refusal, to):
    write(("Cast", ("x",), {"to": to}), HIDDEN, ("Elu", ("x",), {}), LAST)
    assert "operation Cast with operands it does not take" in refusal(path)


@pytest.mark.parametrize(
    ("option", "wanted"),
    [
        ({"value_float": 2.0}, V),
        ({"value_int": 2}, V),
        ({"value_floats": [2.0, 4.0, 6.0]}, V * [[1], [2], [3]]),
        ({"value_ints": [2, 4, -6]}, V * [[1], [2], [-3]]),
    ],
)
def test_constants_may_be_numbers_and_lists(path, option, wanted):
    nodes = [
        helper.make_node("Constant", [], ["c"], **option),
        helper.make_node("MatMul", ["x", "WT"], ["z"]),
        helper.make_node("Elu", ["z"], ["h"]),
        helper.make_node("MatMul", ["h", "VT"], ["v"]),
        helper.make_node("Mul", ["v", "c"], ["y"]),
    ]
    save(path, nodes, ["x"], ["y"], {"WT": W.T, "VT": V.T})
    np.testing.assert_allclose(load_mlp(path).layers[1].weights, 2 * wanted, rtol=1e-6)


@pytest.mark.parametrize("kind", ["Div", "Add", "Neg"])
def test_arithmetic_on_integers_is_refused(path, refusal, kind):
    """ONNX divides whole numbers without a remainder, and lets small types wrap around."""
    operands = ["seven"] if kind == "Neg" else ["seven", "two"]
    nodes = [
        helper.make_node("Constant", [], ["seven"], value_int=7),
        helper.make_node("Constant", [], ["two"], value_int=2),
        helper.make_node(kind, operands, ["n"]),
        helper.make_node("Cast", ["n"], ["c"], to=onnx.TensorProto.FLOAT),
        helper.make_node("Mul", ["x", "c"], ["y"]),
    ]
    save(path, nodes, ["x"], ["y"], {})
    assert "expected arithmetic on floating-point numbers, found integers" in refusal(path)


@pytest.mark.parametrize(
    ("option", "complaint"),
    [
        ({"value_string": "a"}, "expected a constant with value or value_float or value_int or "),
        ({"value": "a"}, "expected numbers of a constant, found a text"),
        ({"value_float": 1.0, "value_int": 1}, "found value_float, value_int"),
        ({}, "found none"),
    ],
)
def test_constants_other_than_numbers_are_refused(path, refusal, option, complaint):
    nodes = [helper.make_node("Constant", [], ["c"], **option)]
    save(path, [*nodes, helper.make_node("Mul", ["x", "c"], ["y"])], ["x"], ["y"], {})
    assert complaint in refusal(path)


@pytest.mark.slow
def test_an_onnx_export_of_rsl_rl_is_read(path, actor, agrees):
    module = actor.as_onnx(verbose=False).eval()
    torch.onnx.export(
        module, module.get_dummy_inputs(), path, input_names=["obs"], output_names=["actions"]
    )
    agrees(load_mlp(path), module)


@pytest.mark.slow
def test_batch_normalisation_is_folded(path, normalised, agrees):
    module = normalised()
    torch.onnx.export(module, (torch.zeros(1, 5),), path)
    assert "BatchNormalization" in {node.op_type for node in onnx.load(path).graph.node}
    agrees(load_mlp(path), module)


CHAIN = "expected a chain of dense layers and activations, found operation"


@pytest.mark.parametrize(
    ("nodes", "complaint"),
    [
        ([HIDDEN, ("Sigmoid", ("x",), {}), LAST], f"{CHAIN} Sigmoid"),
        ([HIDDEN, ("Sigmoid", ("x",), {})], f"{CHAIN} Sigmoid"),
        ([HIDDEN, ("Sigmoid", ("x",), {}), ("Mul", ("x", "x"), {}), LAST], f"{CHAIN} Sigmoid"),
        ([HIDDEN, DIVIDED, ERF, LAST], f"{CHAIN} Erf"),
        ([HIDDEN, DIVIDED, ERF, PLUS], f"{CHAIN} Erf"),
        ([HIDDEN, DIVIDED, ERF, ("Add", ("x", "B"), {}), LAST], f"{CHAIN} Erf"),
        ([HIDDEN, DIVIDED, ERF, ("Mul", ("y0", "x"), {}), LAST], f"{CHAIN} Erf"),
        (
            [HIDDEN, ("Dropout", ("x", "HALF", "YES"), {}), LAST],
            "expected Dropout in evaluation mode, found one with training_mode",
        ),
        ([HIDDEN, ("Swish", ("x",), {"alpha": 2.0}), LAST], "expected Swish with alpha 1, found 2"),
        ([("Add", ("x", "x"), {})], f"{CHAIN} Add with operands it does not take"),
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
            [("Flatten", ("x",), {"axis": 0}), HIDDEN, ("Elu", ("x",), {}), LAST],
            "expected observations in rows, found Flatten with axis 0",
        ),
        (
            [("Flatten", ("B",), {}), HIDDEN],
            "expected observations in rows, found Flatten with axis 1",
        ),
        (
            [HIDDEN, ("BatchNormalization", ("x", "B", "B", "B", "B"), {"training_mode": 1}), LAST],
            "expected BatchNormalization in evaluation mode, found one with training_mode",
        ),
        (
            [("Add", ("B", "B"), {})],
            "expected one output that depends on the observation, found 1 outputs",
        ),
    ],
)
def test_a_graph_other_than_a_perceptron_is_refused(write, path, refusal, nodes, complaint):
    write(*nodes)
    assert refusal(path) == complaint


def test_two_inputs_are_refused(write, path, refusal):
    write(HIDDEN, inputs=("x", "z"))
    assert refusal(path) == "expected one input, the observation, found x, z"


@pytest.fixture
def three(path):
    """Write a graph that returns an action, its deviation and a value, as trainers' exports do."""
    made = [
        helper.make_node("Gemm", ["x", "W", "B"], ["z"], transB=1),
        helper.make_node("Elu", ["z"], ["h"]),
        helper.make_node("Gemm", ["h", "V"], ["mu"], transB=1),
        helper.make_node("Exp", ["h"], ["sigma"]),
        helper.make_node("ReduceSum", ["sigma"], ["value"]),
    ]
    save(path, made, ["x"], ["mu", "sigma", "value"], CONSTANTS)
    return path


def test_the_action_is_named_among_several_outputs(three):
    np.testing.assert_allclose(load_mlp(three, output="mu").layers[1].weights, V, rtol=1e-6)
    for output, complaint in (
        (None, f"expected one output, found mu, sigma, value; {NAME_IT}"),
        ("nu", "expected an output nu, as --output says, found mu, sigma, value; name one of them"),
        ("sigma", f"{CHAIN} Exp; {CURE}"),
    ):
        with pytest.raises(UsageError) as refused:
            load_mlp(three, output=output)
        assert str(refused.value) == f"policy file '{three}': {complaint}"


def test_a_file_that_is_not_onnx_is_refused(path, refusal):
    path.write_text("no model")
    assert refusal(path).startswith("expected an ONNX model, found ")


def node(number: int, **fields: object) -> Callable[[onnx.ModelProto], None]:
    def change(made: onnx.ModelProto) -> None:
        for name, value in fields.items():
            if isinstance(value, list):
                made.graph.node[number].ClearField(name)
                getattr(made.graph.node[number], name).extend(value)
            else:
                setattr(made.graph.node[number], name, value)

    return change


def attribute(**fields: object) -> Callable[[onnx.ModelProto], None]:
    def change(made: onnx.ModelProto) -> None:
        for name, value in fields.items():
            setattr(made.graph.node[0].attribute[0], name, value)

    return change


def products(made: onnx.ModelProto) -> None:
    square = numpy_helper.from_array(np.ones((1500, 1500), dtype=np.float32), "S")
    made.graph.initializer.append(square)
    names = ["S", *(f"s{n}" for n in range(50))]
    nodes = [helper.make_node("MatMul", [a, "S"], [b]) for a, b in pairwise(names)]
    for one in reversed(nodes):
        made.graph.node.insert(0, one)
    made.graph.node[50].input[1] = names[-1]  # the first layer's weights


def made_again(name: str) -> Callable[[onnx.ModelProto], None]:
    """Make a value again behind the first node, which makes z of x and W."""

    def change(made: onnx.ModelProto) -> None:
        made.graph.node.insert(1, helper.make_node("Identity", ["z"], [name]))
        made.graph.node[2].input[0] = name

    return change


@pytest.mark.parametrize("name", ["", None])
def test_gemm_may_omit_its_bias(model, watched, name):
    path = model(node(0, input=["x", "W", *([name] if name is not None else [])]))
    watched(lambda: load_mlp(path))
    assert not load_mlp(path).layers[0].bias.any()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (node(0, input=["", "W", "b"]), "operation Gemm with operands it does not take"),
        (node(0, input=["x", "", "b"]), "operation Gemm with operands it does not take"),
        (
            node(0, input=["x", "W", "b", "b", "b", "b", "b", "b"]),
            "Gemm with operands it does not take",
        ),
        (node(0, input=["missing", "W"]), "found 'missing'"),
        (node(0, input=["y", "W"]), "found 'y'"),
        *((made_again(x), f"operations that make one new value, found {x}") for x in "zxW"),
        (node(0, output=[]), "values that are made before they are used, found 'z'"),
        (node(0, output=["z", "zz"]), "operations that make one new value, found z, zz"),
        (node(0, op_type="Loop"), "operation Loop"),
        (node(0, domain="com.evil"), "operation com.evil.Gemm"),
        (node(0, op_type=""), "found operation "),
        (attribute(type=onnx.AttributeProto.GRAPH), "a value of type 5"),
        (attribute(ref_attr_name="a"), "found a reference"),
        (attribute(name="alphabet"), "operation Gemm with operands it does not take"),
        (attribute(type=onnx.AttributeProto.TENSOR), "values of type 0"),
        (lambda made: setattr(made.graph.output[0], "name", "W"), "one output that depends on"),
        (
            lambda made: setattr(made.graph.output[0], "name", "x"),
            "a linear last layer, or tanh behind it, found none",
        ),
        (lambda made: setattr(made.graph.output[0], "name", ""), "one output that depends on"),
        (lambda made: made.graph.ClearField("output"), "one output, found none"),
        (lambda made: made.ClearField("graph"), "found a damaged one (0 graphs)"),
        (lambda made: made.functions.add(name="Gemm"), "a function Gemm of the file"),
        (products, "2,000,000,000 multiplications of constants"),
    ],
)
def test_malformed_models_are_refused(model, refused, change, complaint):
    assert complaint in refused(model(change))
