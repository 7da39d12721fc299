"""A chain of dense layers, put together from the operations of a file, one by one.

    y = M h + c

h are the values after the last activation, at first the observation. Normalisation, bias, scale and
products of matrices all change M and c alone; an activation ends a layer.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from spikeport.networks.loading.mlp import Mlp, checked
from spikeport.networks.loading.refusal import MismatchError
from spikeport.networks.policy_values import Layer

CHAIN = "a chain of dense layers and activations"

Operations = Mapping[str, Callable[..., object]]
"""What the operations of a format do to chains, arrays and plain values, by name."""


@dataclass(frozen=True, eq=False)
class Chain:
    """What operations have made of the observation; arithmetic with arrays goes on with it.

    Attributes
    ----------
    matrix : ndarray
        M, ``(n, m)``; before the first matrix its diagonal, ``(m,)``, or a factor of all, ``()``.
    constant : ndarray
        c, ``(n,)`` or ``()``.
    layers : tuple of Layer
        Those that ended in an activation.
    activations : tuple of str
        Theirs.
    """

    matrix: np.ndarray = field(default_factory=lambda: np.array(1.0))
    constant: np.ndarray = field(default_factory=lambda: np.array(0.0))
    layers: tuple[Layer, ...] = ()
    activations: tuple[str, ...] = ()

    __array_ufunc__ = None  # arrays leave arithmetic with a chain to the chain

    def dense(self, weights: np.ndarray, bias: np.ndarray | None = None) -> "Chain":
        """Multiply by ``weights`` (n_out, n_in), and add ``bias``."""
        try:
            constant = weights @ np.broadcast_to(self.constant, weights.shape[1:])
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
        return Chain(layers=(*self.layers, self._layer()), activations=(*self.activations, name))

    def mlp(self) -> Mlp:
        """The whole chain, with a dense layer at its end."""
        if not self._is_matrix:
            found = f"{self.activations[-1]} at its end" if self.activations else "none"
            raise MismatchError("a linear last layer", found)
        return checked((*self.layers, self._layer()), self.activations)

    @property
    def _is_matrix(self) -> bool:
        return self.matrix.ndim == 2

    def _layer(self) -> Layer:
        return Layer(self.matrix, self.constant)

    def __add__(self, other: ArrayLike) -> "Chain":
        if isinstance(other, Chain):
            return NotImplemented
        constant = self.constant + _vector(other)
        if self._is_matrix:
            constant = np.broadcast_to(constant, self.matrix.shape[:1])
        return replace(self, constant=constant)

    def __mul__(self, other: ArrayLike) -> "Chain":
        if isinstance(other, Chain):
            return NotImplemented
        factor = _vector(other)
        rows = factor.reshape(-1, 1) if self._is_matrix else factor
        return replace(self, matrix=rows * self.matrix, constant=factor * self.constant)

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


def _vector(value: ArrayLike) -> np.ndarray:
    """Without the axes of a batch, which have to be 1."""
    array = np.asarray(value, dtype=float)
    if max(array.shape[:-1], default=1) != 1:
        raise MismatchError("a vector", f"an array of shape {array.shape}")
    return array.reshape(array.shape[-1:])


def applied(operations: Operations, kind: str, *inputs: object, **options: object) -> object:
    """The value of an operation of a file.

    Raises
    ------
    MismatchError
        It is not known, or joins what is no chain.
    """
    if kind not in operations:
        raise MismatchError(CHAIN, f"operation {kind}")
    try:
        return operations[kind](*inputs, **options)
    except (TypeError, ValueError, AttributeError):
        raise MismatchError(CHAIN, f"operation {kind} of other values") from None


def only(outputs: list[object]) -> Chain:
    """The one output of a file; raises `MismatchError` where that is no chain."""
    match outputs:
        case [Chain() as chain]:
            return chain
    raise MismatchError("one output that depends on the observation", f"{len(outputs)} outputs")


def gelu(x: Chain, approximate: str) -> Chain:
    """The exact GELU has a name of its own; approximations are other functions."""
    return x.activated("gelu" if approximate == "none" else f"gelu ({approximate})")
