"""ONNX files of dense layers: Gemm, MatMul, arithmetic with constants, and activations.

This module reads their fields itself, so that a file is only data: onnx and protobuf make an object
of each message before any message can be refused.
"""

import contextlib
import itertools
import operator
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from spikeport.networks.loading import onnx_tensor
from spikeport.networks.loading.chain import (
    BoundedEvaluation,
    Chain,
    Erf,
    Operations,
    Sigmoid,
    batch_normalised,
    gelu,
    only,
)
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.wire import Message, WireError
from spikeport.reading.archive import read_bytes
from spikeport.reading.mismatch import MismatchError

GRAPH, FUNCTION = 7, 25
"""Fields of a model."""

NODE, INITIALIZER, INPUT, OUTPUT = 1, 5, 11, 12
"""Fields of a graph."""

OF, MADE, KIND, OPTION, DOMAIN = 1, 2, 4, 5, 7
"""Fields of a node: names of inputs and outputs, operation, attributes, the operation's domain."""

NAME, REAL, WHOLE, TEXT, TENSOR, REALS, WHOLES, TYPE, REFERENCE = 1, 2, 3, 4, 5, 7, 8, 20, 21
"""Fields of an attribute; other messages have their name in field `NAME`, too."""

CONSTANTS = ("value", "value_float", "value_int", "value_floats", "value_ints")
"""The attributes of a constant, which has exactly one of them."""

FLOATS = (1, 11)
"""ONNX's numbers of the types of single and double precision."""

NAME_IT = "name the action with --output of `spikeport convert`, or export it alone"
FUNCTION_DOMAIN = 10
STANDARD = ("", "ai.onnx")
"""Names of the domain of ONNX's standard operations."""


def _gemm(
    A: Chain,
    B: np.ndarray,
    C: np.ndarray | None = None,
    alpha: float = 1.0,
    beta: float = 1.0,
    transA: int = 0,
    transB: int = 0,
) -> Chain:
    if transA:
        raise MismatchError("observations in rows", "Gemm with transA")
    product = alpha * (A @ (B.T if transB else B))
    return product if C is None else product + beta * C


def _elu(x: Chain, alpha: float = 1.0) -> Chain:
    if alpha != 1:
        raise MismatchError("ELU with alpha 1", f"{alpha:g}")
    return x.activated("elu")


def _batch_norm(
    x: Chain,
    scale: np.ndarray,
    B: np.ndarray,
    mean: np.ndarray,
    var: np.ndarray,
    epsilon: float = 1e-5,
    momentum: float = 0.9,
    training_mode: int = 0,
) -> Chain:
    if training_mode:
        raise MismatchError("BatchNormalization in evaluation mode", "one with training_mode")
    return batch_normalised(x, scale, B, mean, var, epsilon)


def _dropout(
    x: object, ratio: object = None, training_mode: object = None, seed: int = 0
) -> object:
    if np.any(np.asarray(training_mode, dtype=bool)):
        raise MismatchError("Dropout in evaluation mode", "one with training_mode")
    return x


def _swish(x: Chain, alpha: float = 1.0) -> Chain:
    if alpha != 1:
        raise MismatchError("Swish with alpha 1", f"{alpha:g}")
    return x.activated("silu")


def _cast(x: object, to: int, saturate: int = 1) -> object:
    if to not in FLOATS:
        raise TypeError(to)
    return np.asarray(x, float) if isinstance(x, np.ndarray) else x


def _of_floats(operation: Callable[[Any, Any], object]) -> Callable[[object, object], object]:
    """Return an operation that refuses two integers, which ONNX divides and wraps as integers."""

    def apply(a: object, b: object) -> object:
        if _are_whole(a) and _are_whole(b):
            raise MismatchError("arithmetic on floating-point numbers", "integers")
        return operation(*(np.asarray(x, float) if _are_whole(x) else x for x in (a, b)))

    return apply


def _negative(x: Any) -> object:
    return _of_floats(operator.mul)(np.array(-1) if _are_whole(x) else -1.0, x)


def _are_whole(x: object) -> bool:
    return isinstance(x, np.ndarray | np.generic) and x.dtype.kind in onnx_tensor.WHOLE


def _flatten(x: Chain | np.ndarray, axis: int = 1) -> Chain | np.ndarray:
    # A vector would become a column.
    if axis != 1 or (isinstance(x, np.ndarray) and x.ndim != 2):
        raise MismatchError("observations in rows", f"Flatten with axis {axis}")
    return x


OPERATIONS: Operations = {
    "Identity": lambda x: x,
    "Flatten": _flatten,
    "Cast": _cast,
    "Gemm": _gemm,
    "MatMul": operator.matmul,
    "Add": _of_floats(operator.add),
    "Sub": _of_floats(operator.sub),
    "Neg": _negative,
    "Mul": _of_floats(operator.mul),
    "Div": _of_floats(operator.truediv),
    "Elu": _elu,
    "Relu": lambda x: x.activated("relu"),
    "Tanh": lambda x: x.activated("tanh"),
    "Gelu": lambda x, approximate=b"none": gelu(x, approximate.decode()),
    "Clip": lambda x, min=None, max=None: x.clipped(min, max),
    "BatchNormalization": _batch_norm,
    "Dropout": _dropout,
    "Swish": _swish,
    "Erf": Erf,  # exports to opsets below 20 write GELU in parts
    "Sigmoid": Sigmoid,  # torch writes SiLU as its product with its own input
}


def read(path: Path, output: str | None = None) -> Mlp:
    """Return the layers of a model's graph; ``output`` names the action, if it has other outputs.

    Nodes that the action does not depend on are not computed: exports of trainers also return
    values and deviations.
    """
    with _whole():
        model = Message(read_bytes(path))
        graphs = list(model.messages(GRAPH))
        if len(graphs) != 1:
            raise WireError(f"{len(graphs)} graphs")
        own = {_kind(function, FUNCTION_DOMAIN, NAME) for function in model.messages(FUNCTION)}
        return _Graph(path, own).chain(graphs[0], output).mlp()


def external_files(path: Path) -> list[Path]:
    """Return the files beside a model that hold some of its numbers, each once.

    Paths elsewhere are left out: a tensor that is used must not be there.
    """
    with _whole():
        graphs = list(Message(read_bytes(path)).messages(GRAPH))
        stored = (tensor for graph in graphs for tensor in graph.messages(INITIALIZER))
        nodes = (node for graph in graphs for node in graph.messages(NODE))
        constant = (
            tensor
            for node in nodes
            for option in node.messages(OPTION)
            for tensor in option.messages(TENSOR)
        )
        names = set(map(onnx_tensor.location, itertools.chain(stored, constant)))
    return [path.with_name(name) for name in sorted(filter(onnx_tensor.is_neighbour, names))]


@contextlib.contextmanager
def _whole() -> Iterator[None]:
    """Refuse bytes that are not protobuf messages as a damaged model."""
    try:
        yield
    except WireError as error:
        raise MismatchError("an ONNX model", f"a damaged one ({error})") from error


def _kind(message: Message, domain: int, name: int) -> str:
    space = message.text(domain)
    return ".".join([space] * (space not in STANDARD) + [message.text(name)])


def _chosen(outputs: list[str], output: str | None) -> str:
    """Return the name of the action."""
    found = ", ".join(outputs) or "none"
    if output is None and len(outputs) != 1:
        raise MismatchError("one output", found, cure=NAME_IT)
    if output is not None and output not in outputs:
        raise MismatchError(f"an output {output}, as --output says", found, cure="name one of them")
    return output or outputs[0]


def _needed(graph: Message, output: str) -> list[Message]:
    """Return the nodes that an output depends on, in their order: values are made before use."""
    names, nodes = {output}, []
    for node in reversed(list(graph.messages(NODE))):
        if not names.isdisjoint(node.texts(MADE)):
            names.update(filter(None, node.texts(OF)))  # an omitted input has no name
            nodes.append(node)
    return nodes[::-1]


def _constant(options: Mapping[str, object]) -> np.ndarray:
    """Return the numbers of a constant."""
    if len(options) != 1 or not options.keys() <= set(CONSTANTS):
        raise MismatchError(
            f"a constant with {' or '.join(CONSTANTS)}", ", ".join(options) or "none"
        )
    (value,) = options.values()
    if isinstance(value, bytes):
        raise MismatchError("numbers of a constant", "a text")
    return np.asarray(value)


class _Graph:
    """The values of a graph by name, as far as they are computed."""

    def __init__(self, path: Path, own: set[str]) -> None:
        self._path, self._own = path, own
        self._evaluation = BoundedEvaluation(OPERATIONS)
        self._values: dict[str, object] = {}
        self._stored: dict[str, Message] = {}

    def chain(self, graph: Message, output: str | None) -> Chain:
        """Return an output of the graph for the observation, as a chain."""
        self._stored = {t.text(onnx_tensor.NAME): t for t in graph.messages(INITIALIZER)}
        named = [x.text(NAME) for x in graph.messages(INPUT)]
        # Early versions of ONNX list stored tensors among the inputs as well.
        inputs = [name for name in named if name not in self._stored]
        if len(inputs) != 1:
            raise MismatchError("one input, the observation", ", ".join(inputs) or "none")
        wanted = _chosen([y.text(NAME) for y in graph.messages(OUTPUT)], output)
        self._values[inputs[0]] = Chain()
        for node in _needed(graph, wanted):
            self._make(node)
        return only([self._value(wanted)])

    def _make(self, node: Message) -> None:
        # As in ONNX, one node makes a value, and no later node replaces it.
        made = [name for name in node.texts(MADE) if name]
        if len(made) != 1 or made[0] in self._values or made[0] in self._stored:
            raise MismatchError("operations that make one new value", ", ".join(made) or "none")
        self._values[made[0]] = self._result(node)

    def _result(self, node: Message) -> object:
        options = dict(map(self._option, node.messages(OPTION)))
        kind = _kind(node, DOMAIN, KIND)
        # A function of the file takes precedence over an operation of ONNX of the same name.
        if kind in self._own:
            raise MismatchError("operations of ONNX", f"a function {kind} of the file")
        if kind == "Constant":
            return _constant(options)
        names = node.texts(OF)
        while names and not names[-1]:  # an optional input that is left out
            names.pop()
        return self._evaluation.apply(kind, *map(self._value, names), **options)

    def _value(self, name: str) -> object:
        if name in self._values:
            return self._values[name]
        if not name:
            return None
        if name not in self._stored:
            raise MismatchError("values that are made before they are used", f"'{name}'")
        stored = onnx_tensor.array(self._stored[name], self._path)
        self._values[name] = self._evaluation.keep(stored)
        return self._values[name]

    def _option(self, option: Message) -> tuple[str, object]:
        name, kind = option.text(NAME), option.number(TYPE)
        if REFERENCE in option:
            raise MismatchError(f"a value of {name}", "a reference")
        # The types of AttributeProto: FLOAT, INT, STRING, TENSOR, FLOATS, INTS.
        match kind:
            case 1:
                return name, option.real(REAL)
            case 2:
                return name, option.number(WHOLE)
            case 3:
                return name, bytes(option.content(TEXT))
            case 4:
                (tensor, *_) = [*option.messages(TENSOR)] or [Message(b"")]
                # Counted one by one: a node may have thousands.
                return name, self._evaluation.keep(onnx_tensor.array(tensor, self._path))
            case 6:
                numbers = onnx_tensor.in_field(option, REALS, onnx_tensor.FLOAT)
                return name, self._evaluation.keep(numbers)
            case 7:
                return name, self._evaluation.keep(np.array(option.numbers(WHOLES)))
        raise MismatchError(f"a number, a text or a tensor as {name}", f"a value of type {kind}")
