"""A chain of dense layers, built from the operations of a file one by one.

    y = M h + c

h are the values after the last activation; before the first one, h is the observation.
Normalisation, bias, scale and matrix products change only M and c; an activation ends a layer. A
clip may bound the observation before the first layer, and the action behind the last one.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from spikeport.networks.loading.ends import Clip, Squash, both
from spikeport.networks.loading.mlp import Mlp, checked
from spikeport.networks.policy_values import Layer
from spikeport.reading.archive import MOST_NUMBERS
from spikeport.reading.mismatch import MismatchError

CHAIN = "a chain of dense layers and activations"

WORK = 2 * 10**9
"""The most multiplications while constants are folded: about a second, or one product of two
1,200 x 1,200 matrices."""

ROUNDING = 1e-4
"""The relative error of weights in single precision that are read as the same."""

MADE = 4 * MOST_NUMBERS
"""The most numbers in all constants of a file: each operation of a layer makes new weights."""

Operations = Mapping[str, Callable[..., object]]
"""Operations of a format on chains, arrays and plain values, by name."""


@dataclass(frozen=True, eq=False)
class Chain:
    """The observation after some operations; arithmetic with arrays adds operations to it.

    Attributes
    ----------
    matrix : ndarray
        M, ``(n, m)``; before the first matrix only its diagonal, ``(m,)``, or one factor, ``()``.
    constant : ndarray
        c, ``(n,)`` or ``()``.
    layers : tuple of Layer
        The layers that ended in an activation.
    activations : tuple of str
        The activations of these layers.
    observed : Clip, optional
        The limits of the observation, in its own units.
    clip : Clip, optional
        The limits of y.
    """

    matrix: np.ndarray = field(default_factory=lambda: np.array(1.0))
    constant: np.ndarray = field(default_factory=lambda: np.array(0.0))
    layers: tuple[Layer, ...] = ()
    activations: tuple[str, ...] = ()
    observed: Clip | None = None
    clip: Clip | None = None

    __array_ufunc__ = None  # NumPy then leaves arithmetic with a chain to the chain

    def dense(self, weights: np.ndarray, bias: np.ndarray | None = None) -> "Chain":
        """Multiply by ``weights`` (n_out, n_in), and add ``bias``."""
        self._check_open()
        try:
            constant = weights @ np.broadcast_to(self.constant, weights.shape[1:])
            # Before the first dense layer, the matrix is a factor for each value, which scales
            # columns.
            matrix = weights @ self.matrix if self._is_matrix else weights * self.matrix
            return replace(self, matrix=matrix, constant=constant) + (0.0 if bias is None else bias)
        except ValueError:
            values, offset = self.matrix.shape[:1], None if bias is None else bias.shape
            shapes = f"weights {weights.shape}, bias {offset}, values {values}"
            raise MismatchError("shapes that fit each other", shapes) from None

    def activated(self, name: str) -> "Chain":
        """End a layer with an activation."""
        if not self._is_matrix:
            raise MismatchError("a dense layer before every activation", f"{name} without one")
        clip = self.clip
        if clip is not None and name == "tanh":
            clip = Clip(np.tanh(clip.low), np.tanh(clip.high))  # tanh rises: limits pass through it
        else:
            self._check_open()
        layers, activations = (*self.layers, self._layer()), (*self.activations, name)
        return Chain(layers=layers, activations=activations, observed=self.observed, clip=clip)

    def clipped(self, low: ArrayLike | None, high: ArrayLike | None) -> "Chain":
        """Bound the values; None is no limit."""
        if low is None and high is None:
            return self
        limits = Clip(
            _vector(-np.inf if low is None else low), _vector(np.inf if high is None else high)
        )
        if not (limits.low <= limits.high).all():
            raise MismatchError(
                "a lower limit of a clip that is not above its upper one", "another"
            )
        if self.layers or self._is_matrix:
            return replace(self, clip=both(self.clip, limits))
        of_input = limits.before(self.matrix, self.constant)
        return replace(self, observed=both(self.observed, of_input))

    def mlp(self) -> Mlp:
        """Return the whole chain: a dense layer is at its end, and perhaps tanh or a clip."""
        if self._is_matrix:
            mlp = checked((*self.layers, self._layer()), self.activations)
            factor, offset, tanh = np.array(1.0), np.array(0.0), False
        elif self.activations[-1:] == ("tanh",):
            mlp = checked(self.layers, self.activations[:-1])
            factor, offset, tanh = self.matrix, self.constant, True
        else:
            found = f"{self.activations[-1]} at its end" if self.activations else "none"
            raise MismatchError("a linear last layer, or tanh behind it", found)
        is_linear = self.clip is None and not tanh
        squash = None if is_linear else Squash(tanh, factor, offset, self.clip)
        for end, size in ((self.observed, mlp.sizes[0]), (squash, mlp.sizes[-1])):
            if end is not None:
                end.check(size)
        return replace(mlp, observed=self.observed, squash=squash)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of its matrix."""
        return self.matrix.shape

    @property
    def _is_matrix(self) -> bool:
        return self.matrix.ndim == 2

    def _layer(self) -> Layer:
        return Layer(self.matrix, self.constant)

    def _check_open(self) -> None:
        """Refuse a further operation on clipped values: no weights compute a clip."""
        if self.clip is not None:
            raise MismatchError("a clip of the observation or the action", "one between layers")

    def __add__(self, other: ArrayLike) -> "Chain":
        # `NotImplemented` makes Python raise a TypeError, which `BoundedEvaluation` turns into a
        # refusal: the sum of two chains is a connection around layers, which no perceptron has.
        if isinstance(other, Chain):
            return NotImplemented
        constant = self.constant + _vector(other)
        if self._is_matrix:
            constant = np.broadcast_to(constant, self.matrix.shape[:1])
        clip = self.clip and self.clip.shifted(_vector(other))
        return replace(self, constant=constant, clip=clip)

    def __mul__(self, other: ArrayLike) -> "Chain":
        if isinstance(other, Chain | Sigmoid | Erf):
            return NotImplemented
        factor = _vector(other)
        rows = factor.reshape(-1, 1) if self._is_matrix else factor
        clip = self.clip and self.clip.scaled(factor)
        return replace(self, matrix=rows * self.matrix, constant=factor * self.constant, clip=clip)

    def __sub__(self, other: ArrayLike) -> "Chain":
        return NotImplemented if isinstance(other, Chain) else self + -_vector(other)

    def __rsub__(self, other: ArrayLike) -> "Chain":
        return self * -1.0 + other

    def __truediv__(self, other: ArrayLike) -> "Chain":
        return NotImplemented if isinstance(other, Chain) else self * (1 / _vector(other))

    def __matmul__(self, other: np.ndarray) -> "Chain":
        return NotImplemented if isinstance(other, Chain) else self.dense(other.T)

    __radd__ = __add__
    __rmul__ = __mul__


@dataclass(frozen=True, eq=False)
class Sigmoid:
    """The logistic function of a chain: SiLU once it is multiplied by the same chain."""

    chain: Chain

    def __mul__(self, other: object) -> Chain:
        return self.chain.activated("silu") if other is self.chain else NotImplemented

    __rmul__ = __mul__


@dataclass(frozen=True, eq=False)
class Erf:
    """The error function of a chain with a factor and an offset: GELU in parts.

    s x * f (1 + erf(x / sqrt(2))) = 2 s f gelu(x)
    """

    chain: Chain
    factor: float = 1.0
    offset: float = 0.0

    __array_ufunc__ = None

    def __add__(self, other: ArrayLike) -> "Erf":
        return replace(self, offset=self.offset + _scalar(other))

    def __mul__(self, other: object) -> "Erf | Chain":
        if not isinstance(other, Chain):
            by = _scalar(other)
            return replace(self, factor=by * self.factor, offset=by * self.offset)
        share = self._share_of(other)
        if self.offset != self.factor or share is None:
            return NotImplemented
        return (other * (1 / share)).activated("gelu") * (2 * share * self.factor)

    def _share_of(self, other: Chain) -> float | None:
        """Return s for a chain s x, if this one is x / sqrt(2); None if it is not."""
        mine, its = (
            np.hstack([one.matrix, np.reshape(one.constant, (-1, 1))]) if one._is_matrix else None
            for one in (self.chain, other)
        )
        # Arithmetic keeps these objects; another activation or clip would have made others.
        alike = all(
            getattr(self.chain, name) is getattr(other, name)
            for name in ("layers", "activations", "observed", "clip")
        )
        if mine is None or its is None or not alike or mine.shape != its.shape:
            return None
        place = np.unravel_index(np.abs(mine).argmax(), mine.shape)
        share = float(its[place] / mine[place] / math.sqrt(2))
        is_one = np.allclose(its, share * math.sqrt(2) * mine, rtol=ROUNDING, atol=0)
        return share if is_one and share > 0 else None

    __radd__ = __add__
    __rmul__ = __mul__


def _scalar(value: object) -> float:
    """Return the only number of an array; TypeError if there are several."""
    array = np.asarray(value, dtype=float)
    if array.size != 1:
        raise TypeError(f"{array.size} numbers")
    return float(array.item())


def _vector(value: ArrayLike) -> np.ndarray:
    """Return a value without the axes of a batch, which have to be 1."""
    array = np.asarray(value, dtype=float)
    if max(array.shape[:-1], default=1) != 1:
        raise MismatchError("a vector", f"an array of shape {array.shape}")
    return array.reshape(array.shape[-1:])


class BoundedEvaluation:
    """Evaluator of a file's operations, one by one, up to a limit of work.

    Constants are folded while a file is read, and a short file may ask for endless products.
    """

    def __init__(self, operations: Operations) -> None:
        self._operations, self._work, self._made = operations, 0, 0

    def apply(self, kind: str, *inputs: object, **options: object) -> object:
        """Return the value of an operation.

        Raises
        ------
        MismatchError
            The operation is unknown, is not one of a chain of layers, or is too much work.
        """
        if kind not in self._operations:
            raise MismatchError(CHAIN, f"operation {kind}")
        values = (*inputs, *options.values())
        self._spend([x.shape for x in values if isinstance(x, np.ndarray | Chain)])
        try:
            with np.errstate(all="ignore"):  # numbers that are not finite are refused in the end
                made = self._operations[kind](*inputs, **options)
        except (TypeError, ValueError, AttributeError, OverflowError):
            parts = [type(x).__name__ for x in values if isinstance(x, Sigmoid | Erf)]
            found = parts[0] if parts else f"{kind} with operands it does not take"
            raise MismatchError(CHAIN, f"operation {found}") from None
        return self.keep(made)

    def keep(self, made: object) -> object:
        """Return a new value, after its numbers are counted."""
        if isinstance(made, np.ndarray):
            self._count(made.size)
        if isinstance(made, Chain):
            self._count(made.matrix.size)
        return made

    def _spend(self, shapes: list[tuple[int, ...]]) -> None:
        if any(len(shape) > 2 for shape in shapes):
            raise MismatchError("vectors and matrices", "an array of more axes")
        self._work += _work(shapes)
        if self._work > WORK:
            raise MismatchError(f"at most {WORK:,} multiplications of constants", "more")
        # Checked before the operation allocates them; `keep` counts the numbers that it makes.
        self._count(_size(shapes), kept=False)

    def _count(self, numbers: int, kept: bool = True) -> None:
        if self._made + numbers > MADE:
            raise MismatchError(f"at most {MADE:,} numbers in all constants", "more")
        self._made += numbers if kept else 0


def _work(shapes: list[tuple[int, ...]]) -> int:
    """Return how many multiplications an operation of such arrays takes at most."""
    if _matrices(shapes) > 1:  # perhaps a matrix product
        return max(map(math.prod, shapes)) * max(n for shape in shapes for n in shape)
    return _size(shapes)


def _size(shapes: list[tuple[int, ...]]) -> int:
    """Return how many numbers an operation of such arrays makes at most."""
    try:
        return math.prod(np.broadcast_shapes(*shapes))
    except ValueError:  # then it is a matrix product, or an error
        lengths = sorted((n for shape in shapes for n in shape), reverse=True)
        largest = max(map(math.prod, shapes))
        return math.prod(lengths[:2]) if _matrices(shapes) > 1 else largest


def _matrices(shapes: list[tuple[int, ...]]) -> int:
    return sum(len(shape) == 2 and min(shape) > 1 for shape in shapes)


def only(outputs: list[object]) -> Chain:
    """Return the one output of a file; raise `MismatchError` if it is not a chain."""
    match outputs:
        case [Chain() as chain]:
            return chain
        case [Sigmoid() | Erf() as part]:
            raise MismatchError(CHAIN, f"operation {type(part).__name__}")
    raise MismatchError("one output that depends on the observation", f"{len(outputs)} outputs")


def gelu(x: Chain, approximate: object) -> Chain:
    """Return GELU of a chain; an approximation is another function than the exact GELU."""
    if not isinstance(approximate, str):
        raise TypeError(type(approximate).__name__)
    return x.activated("gelu" if approximate == "none" else f"gelu ({approximate})")


def batch_normalised(
    x: Chain,
    weight: np.ndarray | None,
    bias: np.ndarray | None,
    mean: np.ndarray,
    variance: np.ndarray,
    epsilon: float,
) -> Chain:
    """Return a chain normalised with the mean and variance from training."""
    scale = (1.0 if weight is None else weight) / np.sqrt(variance + epsilon)
    return (x - mean) * scale + (0.0 if bias is None else bias)
