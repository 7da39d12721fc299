"""The linear nodes of NIR as sparse matrices: y = M x + b, over arrays laid out in C order.

A convolution's output (o, p) is the sum over input channels i of its group and kernel offsets a

    y[o, p] = sum_{i, a} w[o, i, a] x[i, p s + a d - l] + b[o]

with stride s, dilation d and l zeros before the input; pooling is a convolution of each channel by
itself, with weights of 1, or of 1 over the size of the kernel.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from spikeport.networks.loading.nir.graph import Node
from spikeport.reading.mismatch import MismatchError

Shape = tuple[int, ...]

SIZE = 2**20
"""The most values between nodes: eight times the compartments of a chip."""
ENTRIES = 2**23
"""The most weights of a matrix: several times the synapses that a chip can have."""


class Operator(NamedTuple):
    """A matrix (n_out, n_in), its bias (n_out,), the shape of its output, and its delay."""

    matrix: sparse.csr_matrix
    bias: np.ndarray
    shape: Shape
    n_steps: int = 0


def operator(node: Node, shape: Shape, dt_s: float) -> Operator:
    """Return the operator of a linear node for an input of a shape.

    Raises
    ------
    MismatchError
        The node does not take that shape, or is too large.
    """
    found = OPERATORS[node.kind](node, shape, dt_s)
    if not 1 <= math.prod(found.shape) <= SIZE:
        raise MismatchError(f"from 1 to {SIZE:,} values after node {node.name}", f"{found.shape}")
    return found


def fit(*shapes: Shape) -> bool:
    """Return whether shapes differ only in axes of 1, and in axes that some of them merge."""
    # The places at which axes end, in C order: merged axes have some of those of single ones.
    ends = sorted(({1, *np.cumprod(shape, dtype=float)} for shape in shapes), key=len)
    merged = all(fewer <= more for fewer, more in itertools.pairwise(ends))
    return merged and len(set(map(math.prod, shapes))) <= 1


def _check_weights(node: Node, n: int) -> None:
    if n > ENTRIES:
        raise MismatchError(
            f"at most {ENTRIES:,} weights in node {node.name}",
            f"{n:,}",
            cure="give it fewer inputs or outputs, or, where each output is a multiple of one "
            "input, make it a Scale, which has a weight for each",
        )


def _identity(shape: Shape, scale: np.ndarray | None = None) -> sparse.csr_matrix:
    n = math.prod(shape)
    return sparse.diags_array(np.ones(n) if scale is None else scale).tocsr()


def _same(node: Node, shape: Shape, dt_s: float) -> Operator:
    return Operator(_identity(shape), np.zeros(math.prod(shape)), shape)


def _affine(node: Node, shape: Shape, dt_s: float) -> Operator:
    weight = node.numbers("weight")
    if weight.ndim != 2:
        raise MismatchError(f"a weight of 2 axes in node {node.name}", f"{weight.ndim}")
    rows = shape[:-1] if shape[-1] == weight.shape[1] else ()
    n_rows = math.prod(rows)
    if math.prod(shape) != n_rows * weight.shape[1]:
        raise MismatchError(f"{weight.shape[1]} values into node {node.name}", f"{shape}")
    bias = np.zeros(len(weight))
    if node.kind == "Affine":
        bias = np.ravel(node.numbers("bias"))
        if bias.size != len(weight):
            raise MismatchError(f"{len(weight)} biases in node {node.name}", f"{bias.size}")
    _check_weights(node, n_rows * weight.size)
    matrix = sparse.kron(sparse.eye_array(n_rows), sparse.csr_matrix(weight), format="csr")
    return Operator(sparse.csr_matrix(matrix), np.tile(bias, n_rows), (*rows, len(weight)))


def _scale(node: Node, shape: Shape, dt_s: float) -> Operator:
    scale = node.numbers("scale")
    n = math.prod(shape)
    try:
        each = np.broadcast_to(scale.reshape(shape) if fit(scale.shape, shape) else scale, shape)
    except ValueError:
        raise MismatchError(f"scale for {shape} in node {node.name}", f"{scale.shape}") from None
    return Operator(_identity(shape, each.ravel()), np.zeros(n), shape)


def _delay(node: Node, shape: Shape, dt_s: float) -> Operator:
    delay = np.ravel(node.numbers("delay"))
    is_step = np.isclose(delay, dt_s, rtol=1e-6, atol=0)
    wrong = delay[~(is_step | (delay == 0))]
    if wrong.size:
        raise MismatchError(
            f"node {node.name} to delay by 0 or {dt_s:g} s, the step that every path takes on the "
            "chip",
            f"{wrong[0]:g} s",
            cure="leave the node out, or, if so coarse a step is acceptable, set --dt to the delay",
        )
    if is_step.any() and not is_step.all():
        raise MismatchError(f"node {node.name} to delay all values alike", f"0 and {dt_s:g} s")
    return _same(node, shape, dt_s)._replace(n_steps=int(is_step.any()))


def _flatten(node: Node, shape: Shape, dt_s: float) -> Operator:
    start, end = node.one("start_dim", -len(shape)), node.one("end_dim", -len(shape))
    if start == len(shape) and end == -1:  # no axis follows the batch's
        return _same(node, shape, dt_s)
    end = end + len(shape) if end < 0 else end
    start = start + len(shape) if start < 0 else start
    if not 0 <= start <= end < len(shape):
        raise MismatchError(f"axes of {shape} to flatten in node {node.name}", f"{start} to {end}")
    flat = (*shape[:start], math.prod(shape[start : end + 1]), *shape[end + 1 :])
    return _same(node, flat, dt_s)


def _convolution(node: Node, shape: Shape, dt_s: float) -> Operator:
    weight = node.numbers("weight")
    n_axes = 1 if node.kind == "Conv1d" else 2
    batch, shape = _batch(node, shape, n_axes)
    _check_space(node, shape[1:])
    if weight.ndim != 2 + n_axes:
        raise MismatchError(f"a weight of {2 + n_axes} axes in node {node.name}", f"{weight.ndim}")
    if not weight.size:
        raise MismatchError(f"weights in node {node.name}", f"an empty shape {weight.shape}")
    groups = node.one("groups")
    if groups < 1 or len(weight) % groups or weight.shape[1] * groups != shape[0]:
        raise MismatchError(
            f"{shape[0]} channels in node {node.name}", f"{groups} groups of {weight.shape[1]}"
        )
    stride, dilation = (_each(node, name, n_axes) for name in ("stride", "dilation"))
    padding = _padding(node, weight.shape[2:], stride, dilation)
    matrix, space = _convolved(node, weight, groups, shape, stride, dilation, padding)
    bias = np.ravel(node.numbers("bias")) if "bias" in node.values else np.zeros(1)
    if bias.size not in (1, len(weight)):
        raise MismatchError(f"{len(weight)} biases in node {node.name}", f"{bias.size}")
    biases = np.repeat(np.resize(bias, len(weight)), math.prod(space))
    return Operator(matrix, biases, (*batch, len(weight), *space))


def _batch(node: Node, shape: Shape, n_axes: int) -> tuple[Shape, Shape]:
    """Return axes of a batch of one, if any, and those of channels and space."""
    first = len(shape) - 1 - n_axes
    if first < 0 or math.prod(shape[:first]) != 1:
        raise MismatchError(
            f"channels and {n_axes} axes of space into node {node.name}", f"{shape}"
        )
    return shape[:first], shape[first:]


def _check_space(node: Node, space: Shape) -> None:
    """Refuse an ``input_shape`` that is not the space of the values that reach a convolution."""
    if isinstance(node.values.get("input_shape"), np.ndarray):
        stated = node.whole("input_shape")
        if stated != space:
            raise MismatchError(
                f"input_shape {space} in node {node.name}, as the nodes before it have it",
                f"{stated}",
            )


def _pooling(node: Node, shape: Shape, dt_s: float) -> Operator:
    batch, shape = _batch(node, shape, 2)
    kernel, stride = (_each(node, name, 2) for name in ("kernel_size", "stride"))
    _check_weights(node, shape[0] * math.prod(kernel))  # before the weights are made
    padding = [(n, n) for n in _each(node, "padding", 2, least=0)]
    value = 1.0 / math.prod(kernel) if node.kind == "AvgPool2d" else 1.0
    weight = np.full((shape[0], 1, *kernel), value)
    matrix, space = _convolved(node, weight, shape[0], shape, stride, (1, 1), padding)
    return Operator(matrix, np.zeros(matrix.shape[0]), (*batch, shape[0], *space))


def _convolved(
    node: Node,
    weight: np.ndarray,
    groups: int,
    shape: Shape,
    stride: Shape,
    dilation: Shape,
    padding: list[tuple[int, int]],
) -> tuple[sparse.csr_matrix, Shape]:
    """Return the matrix of a convolution, and the space of its output."""
    kernel, extent = weight.shape[2:], shape[1:]
    steps = zip(extent, padding, dilation, kernel, stride, strict=True)
    space = tuple((n + a + b - d * (k - 1) - 1) // s + 1 for n, (a, b), d, k, s in steps)
    if min(space) < 1:
        raise MismatchError(f"a kernel within {extent} in node {node.name}", f"{kernel}")
    _check_weights(node, weight.size * math.prod(space))
    places = [
        np.arange(m)[:, np.newaxis] * s + np.arange(k) * d - a
        for m, k, s, d, (a, _) in zip(space, kernel, stride, dilation, padding, strict=True)
    ]
    return _entries(weight, groups, shape, space, places), space


def _entries(
    weight: np.ndarray, groups: int, shape: Shape, space: Shape, places: list[np.ndarray]
) -> sparse.csr_matrix:
    """Return the matrix; ``places`` has the inputs of each output and offset, axis by axis."""
    n_out, per_group, *kernel = weight.shape
    axes = (n_out, per_group, *space, *kernel)
    index = np.indices(axes, sparse=True)
    channel = index[1] + index[0] // (n_out // groups) * per_group
    column, inside = channel, np.ones((1,) * len(axes), dtype=bool)
    row = index[0]
    for axis, (place, extent) in enumerate(zip(places, shape[1:], strict=True)):
        here = place[index[2 + axis], index[2 + len(space) + axis]]
        column, inside = column * extent + here, inside & (here >= 0) & (here < extent)
        row = row * space[axis] + index[2 + axis]
    values = weight.reshape(n_out, per_group, *(1,) * len(space), *kernel)
    found = np.broadcast_to(inside, axes) & (np.broadcast_to(values, axes) != 0)
    entries = (np.broadcast_to(array, axes)[found] for array in (values, row, column))
    data, rows, columns = entries
    size = (n_out * math.prod(space), math.prod(shape))
    return sparse.csr_matrix((data, (rows, columns)), shape=size)


def _each(node: Node, field: str, n_axes: int, least: int = 1) -> Shape:
    """Return a whole number for each axis of space; a single number stands for all."""
    found = node.whole(field)
    if len(found) not in (1, n_axes) or min(found) < least:
        wanted = f"{field} with a number from {least} on for each axis in node {node.name}"
        raise MismatchError(wanted, f"{found}")
    return found * n_axes if len(found) == 1 else found


def _padding(node: Node, kernel: Shape, stride: Shape, dilation: Shape) -> list[tuple[int, int]]:
    """Return the zeros before and after each axis."""
    padding = node.values["padding"]
    if isinstance(padding, str):
        if padding not in ("same", "valid"):
            raise MismatchError(f"padding same or valid in node {node.name}", padding)
        # Frameworks place these zeros differently, or refuse them, as torch does.
        if padding == "same" and max(stride) > 1:
            raise MismatchError(
                f"a stride of 1 with padding same in node {node.name}",
                f"{stride}",
                cure="give the padding in numbers",
            )
        around = [
            d * (k - 1) if padding == "same" else 0 for d, k in zip(dilation, kernel, strict=True)
        ]
        return [(n // 2, n - n // 2) for n in around]
    return [(n, n) for n in _each(node, "padding", len(kernel), least=0)]


OPERATORS: dict[str, Callable[[Node, Shape, float], Operator]] = {
    "InnerInput": _same,
    "InnerOutput": _same,
    "Affine": _affine,
    "Linear": _affine,
    "Scale": _scale,
    "Delay": _delay,
    "Flatten": _flatten,
    "Conv1d": _convolution,
    "Conv2d": _convolution,
    "SumPool2d": _pooling,
    "AvgPool2d": _pooling,
}
