"""TorchScript files, as Isaac Lab and rsl-rl export them: read as text, and without torch.

NAME/data.pkl        the module, its submodules, their numbers and tensors
NAME/constants.pkl   constants of the text
NAME/code/...        the text, a file for each package of the modules' classes
"""

import operator
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from spikeport.networks.loading.chain import (
    BoundedEvaluation,
    Chain,
    Operations,
    Sigmoid,
    batch_normalised,
    gelu,
    only,
)
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.pickles import Known, Module, ModuleClass
from spikeport.networks.loading.script import Interpreter, Program
from spikeport.networks.loading.tensors import plain_name
from spikeport.networks.loading.torch_file import folder_of, pickled
from spikeport.reading.archive import Archive, read_bytes
from spikeport.reading.mismatch import MismatchError

TEXT_BYTES = 2**18
"""The most bytes of text that are parsed: a policy has some ten thousand."""

FLOATS = (6, 7)
"""PyTorch's numbers of the types of single and double precision."""

LISTS = "torch.jit._pickle.build_"
TAGGED = "torch.jit._pickle.restore_type_tag"


def _number(value: object) -> Any:
    """Return an operand of a chain, or an array; refuse texts, and integers beyond a float."""
    match value:
        case Chain() | Sigmoid():
            return value
        case float() | int() | np.ndarray():
            return np.asarray(value, dtype=float)
    raise TypeError(type(value).__name__)


def _arithmetic(operation: Callable[..., object]) -> Callable[..., object]:
    return lambda a, b: operation(_number(a), _number(b))


def _scaled(operation: Callable[..., object]) -> Callable[..., object]:
    """Return an operation whose second operand is multiplied by ``alpha``."""
    return lambda a, b, alpha=1: operation(_number(a), _number(alpha) * _number(b))


def _comparison(operation: Callable[..., bool]) -> Callable[..., bool]:
    """Return a comparison of plain numbers only: its result must not depend on the observation."""

    def compare(a: object, b: object) -> bool:
        if not (isinstance(a, int | float) and isinstance(b, int | float)):
            raise TypeError(type(a).__name__)
        return operation(a, b)

    return compare


def _elu(x: Chain, *parameters: float) -> Chain:
    if any(parameter != 1 for parameter in parameters):
        raise MismatchError("ELU with alpha 1", ", ".join(f"{p:g}" for p in parameters))
    return x.activated("elu")


def _addmm(bias: object, x: object, W: object, beta: object = 1.0, alpha: object = 1.0) -> object:
    return _number(beta) * _number(bias) + _number(alpha) * (_number(x) @ _number(W))


def _evaluated(training: object) -> None:
    # A script reads `training` of its module, which is False here; a trace has a constant.
    if training is not False:
        found = "dropout or batch normalisation in training mode"
        wanted = "a policy in evaluation mode"
        raise MismatchError(wanted, found, cure="call eval() before the trace")


def _flatten(x: Chain, start_dim: int = 0, end_dim: int = -1) -> Chain:
    if start_dim != 1 or end_dim not in (1, -1):
        raise MismatchError("observations in rows", f"flatten of axes {start_dim} to {end_dim}")
    return x


def _dropout(x: Chain, p: float, train: object) -> Chain:
    _evaluated(train)
    return x  # the same tensor, as in evaluation mode of torch


def _batch_norm(
    x: Chain,
    weight: np.ndarray | None,
    bias: np.ndarray | None,
    mean: np.ndarray,
    variance: np.ndarray,
    training: object,
    _momentum: float,
    eps: float,
    _cudnn_enabled: bool,
) -> Chain:
    _evaluated(training)
    return batch_normalised(x, weight, bias, mean, variance, eps)


def _ones(sizes: list[int], **_: object) -> np.ndarray:
    # The file chooses the sizes, so they are checked before an array is made.
    if (
        any(type(size) is not int or size < 0 for size in sizes)
        or np.prod(sizes, dtype=float) > 1e6
    ):
        raise ValueError(sizes)
    return np.ones(sizes)


def _to(x: object, *to: object, dtype: object = None, **_: object) -> object:
    """Return values on another device, or of another type; refuse types that round them."""
    # Types are the only numbers among the unnamed arguments; a bool asks for a copy.
    if any(type(one) is int and one not in FLOATS for one in (dtype, *to)):
        raise TypeError(to, dtype)
    return x


def _array(value: object) -> np.ndarray:
    if not isinstance(value, np.ndarray):
        raise TypeError(type(value).__name__)
    return value


OPERATIONS: Operations = {
    "aten::linear": Chain.dense,
    "aten::matmul": _arithmetic(operator.matmul),
    "aten::mm": _arithmetic(operator.matmul),
    "aten::addmm": _addmm,
    "aten::add": _scaled(operator.add),
    "aten::sub": _scaled(operator.sub),
    "aten::rsub": lambda a, b, alpha=1: _number(b) - _number(alpha) * _number(a),
    "aten::neg": lambda x: -1.0 * _number(x),
    "aten::mul": _arithmetic(operator.mul),
    "aten::div": _arithmetic(operator.truediv),
    "aten::elu": _elu,
    "aten::relu": lambda x: x.activated("relu"),
    "aten::tanh": lambda x: x.activated("tanh"),
    "aten::silu": lambda x: x.activated("silu"),
    "aten::sigmoid": Sigmoid,
    "aten::gelu": lambda x, approximate="none": gelu(x, approximate),
    "aten::clamp": lambda x, min=None, max=None: x.clipped(min, max),
    "aten::clip": lambda x, min=None, max=None: x.clipped(min, max),
    "aten::hardtanh": lambda x, min_val=-1, max_val=1: x.clipped(min_val, max_val),
    "aten::flatten": _flatten,
    "aten::t": lambda W: _array(W).T,
    "aten::sqrt": lambda x: np.sqrt(_array(x)),
    "aten::ones": _ones,
    "aten::zeros": lambda sizes, **options: 0.0 * _ones(sizes, **options),
    "aten::dropout": _dropout,
    "aten::batch_norm": _batch_norm,
    # A script checks the axes before batch norm and dropout: observations are rows of a batch.
    "aten::dim": lambda x: 2 if isinstance(x, Chain) else _array(x).ndim,
    "aten::lt": _comparison(operator.lt),
    "aten::gt": _comparison(operator.gt),
    "aten::ne": _comparison(operator.ne),
    # Gradients, copies and devices do not change values.
    "aten::detach": lambda x: x,
    "aten::to": _to,
    # A new object, which may be used after the original was changed in place.
    "aten::clone": lambda x: replace(x) if isinstance(x, Chain) else x,
    "aten::device": lambda _: None,
}


def read(path: Path) -> Mlp:
    """Return the layers of a module's ``forward``."""
    archive = Archive(read_bytes(path))
    folder = folder_of(archive, "a TorchScript module")
    module, constants = (pickled(archive, folder, name, _name) for name in ("data", "constants"))
    if not isinstance(module, Module):
        raise MismatchError("a TorchScript module", type(module).__name__)
    if not isinstance(constants, tuple):
        raise MismatchError("a tuple of constants", type(constants).__name__)
    program = Program(_Texts(archive, f"{folder}code/").text)
    try:
        made = Interpreter(program, constants, BoundedEvaluation(OPERATIONS)).forward(module)
    except RecursionError:
        raise MismatchError("a TorchScript module", "calls nested too deeply") from None
    return only([made]).mlp()


def _name(name: str) -> object:
    """Return the meaning of a name in a pickle of TorchScript."""
    if name.startswith("__torch__."):
        return ModuleClass(name)
    if name.startswith(LISTS):
        return Known(_plain)
    return Known(_plain) if name == TAGGED else plain_name(name)


def _plain(values: object, *_: object) -> object:
    """Return a list or dictionary without the types of its values."""
    return values


class _Texts:
    """The text of an archive's files, up to a total size."""

    def __init__(self, archive: Archive, folder: str) -> None:
        self._archive, self._folder, self._left = archive, folder, TEXT_BYTES

    def text(self, name: str) -> str:
        """Return the text of a file, by the dotted name of its package."""
        content = self._archive.read(f"{self._folder}{name.replace('.', '/')}.py", self._left)
        self._left -= len(content)
        try:
            return content.decode()
        except UnicodeDecodeError:
            raise MismatchError(f"text in {name}", "bytes") from None
