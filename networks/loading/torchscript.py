"""TorchScript files, as Isaac Lab and rsl-rl export them: the graph is read, and never run."""

import operator
from pathlib import Path
from typing import TYPE_CHECKING

from spikeport.networks.loading.chain import Chain, Operations, applied, gelu, only
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.refusal import MismatchError, extra

if TYPE_CHECKING:
    import torch


def _elu(x: Chain, *parameters: float) -> Chain:
    if any(parameter != 1 for parameter in parameters):
        raise MismatchError("ELU with alpha 1", ", ".join(f"{p:g}" for p in parameters))
    return x.activated("elu")


OPERATIONS: Operations = {
    "aten::linear": Chain.dense,
    "aten::matmul": operator.matmul,
    "aten::addmm": lambda b, x, W, beta, alpha: beta * b + alpha * (x @ W),
    "aten::add": lambda a, b, alpha=1: a + alpha * b,
    "aten::sub": lambda a, b, alpha=1: a - alpha * b,
    "aten::rsub": lambda a, b, alpha=1: b - alpha * a,
    "aten::neg": lambda x: -1.0 * x,
    "aten::mul": operator.mul,
    "aten::div": operator.truediv,
    "aten::elu": _elu,
    "aten::relu": lambda x: x.activated("relu"),
    "aten::tanh": lambda x: x.activated("tanh"),
    "aten::silu": lambda x: x.activated("silu"),
    "aten::gelu": gelu,
}


def read(path: Path) -> Mlp:
    """The layers of a module's ``forward``."""
    torch = extra("torch")
    try:
        module = torch.jit.load(path, map_location="cpu").eval()
        graph = torch.jit.freeze(module).graph
    except (RuntimeError, AttributeError) as error:
        raise MismatchError("a TorchScript module", str(error).splitlines()[0]) from error
    observation, *others = list(graph.inputs())[1:]
    if others:
        raise MismatchError("a module of the observation alone", f"{1 + len(others)} inputs")
    values: dict[str, object] = {observation.debugName(): Chain()}
    for node in graph.nodes():
        value = _value(node, [values[x.debugName()] for x in node.inputs()])
        values[node.output().debugName()] = value
    return only([values[x.debugName()] for x in graph.outputs()]).mlp()


def _value(node: "torch.Node", inputs: list[object]) -> object:
    if node.kind() != "prim::Constant":
        return applied(OPERATIONS, node.kind().removesuffix("_"), *inputs)
    constant = node.output().toIValue()
    return constant.double().numpy() if hasattr(constant, "numpy") else constant
