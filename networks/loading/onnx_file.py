"""ONNX files of dense layers: Gemm, MatMul, arithmetic with constants, and activations."""

import operator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from spikeport.networks.loading.chain import Chain, Operations, applied, gelu, only
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.refusal import MismatchError, extra

if TYPE_CHECKING:
    from onnx import GraphProto


def _gemm(
    A: Chain,
    B: np.ndarray,
    C: np.ndarray | float = 0.0,
    alpha: float = 1.0,
    beta: float = 1.0,
    transA: int = 0,
    transB: int = 0,
) -> Chain:
    if transA:
        raise MismatchError("observations in rows", "Gemm with transA")
    return alpha * (A @ (B.T if transB else B)) + beta * C


def _elu(x: Chain, alpha: float = 1.0) -> Chain:
    if alpha != 1:
        raise MismatchError("ELU with alpha 1", f"{alpha:g}")
    return x.activated("elu")


OPERATIONS: Operations = {
    "Identity": lambda x: x,
    "Gemm": _gemm,
    "MatMul": operator.matmul,
    "Add": operator.add,
    "Sub": operator.sub,
    "Neg": lambda x: -1.0 * x,
    "Mul": operator.mul,
    "Div": operator.truediv,
    "Elu": _elu,
    "Relu": lambda x: x.activated("relu"),
    "Tanh": lambda x: x.activated("tanh"),
    "Gelu": lambda x, approximate=b"none": gelu(x, approximate.decode()),
    "Swish": lambda x: x.activated("silu"),
}


def read(path: Path) -> Mlp:
    """The layers of a model's graph."""
    onnx = extra("onnx")
    message = extra("google.protobuf.message")
    try:
        model = onnx.load(path)
        onnx.checker.check_model(model)
    except (message.DecodeError, onnx.checker.ValidationError) as error:
        raise MismatchError("an ONNX model", str(error).strip().splitlines()[0]) from error
    return _chain(onnx, model.graph).mlp()


def _chain(onnx: ModuleType, graph: "GraphProto") -> Chain:
    to_array = onnx.numpy_helper.to_array
    values: dict[str, object] = {t.name: to_array(t).astype(float) for t in graph.initializer}
    inputs = [x.name for x in graph.input if x.name not in values]
    if (len(inputs), len(graph.output)) != (1, 1):
        found = f"{len(inputs)} inputs, {len(graph.output)} outputs"
        raise MismatchError("one input and one output", found)
    values[inputs[0]] = Chain()
    for node in graph.node:
        options = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if node.op_type == "Constant" and "value" in options:
            values[node.output[0]] = to_array(options["value"]).astype(float)
            continue
        kind = ".".join(filter(None, (node.domain, node.op_type)))
        arguments = [values[name] for name in node.input]
        values[node.output[0]] = applied(OPERATIONS, kind, *arguments, **options)
    return only([values[graph.output[0].name]])
