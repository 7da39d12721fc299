"""A multilayer perceptron: the common form of all policy files."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from spikeport.arrays import Floats
from spikeport.networks.activations import ACTIVATIONS
from spikeport.networks.loading.ends import Clip, Squash
from spikeport.networks.policy_values import Layer, exact
from spikeport.reading.mismatch import MismatchError


class Moments(NamedTuple):
    """Mean and standard deviation of each input, ``(n,)``."""

    mean: Floats
    std: Floats


@dataclass(frozen=True)
class Mlp:
    """Dense layers with the same activation after each but the last.

    Attributes
    ----------
    layers : tuple of Layer
        Hidden layers, and the linear last one.
    activation : str
        The function of the hidden layers, one of `spikeport.networks.activations.ACTIVATIONS`.
    trained_on : Moments, optional
        The moments of the inputs in training, if the file has them.
    observed : Clip, optional
        The limits of the inputs, in their own units: values beyond them count as the limits.
    squash : Squash, optional
        The function behind the last layer.
    """

    layers: tuple[Layer, ...]
    activation: str
    trained_on: Moments | None = None
    observed: Clip | None = None
    squash: Squash | None = None

    @property
    def sizes(self) -> tuple[int, ...]:
        """Inputs, units of every hidden layer, outputs."""
        return (self.layers[0].weights.shape[1], *(len(layer.bias) for layer in self.layers))

    def exact(self, observations: np.ndarray) -> list[np.ndarray]:
        """Return pre-activations of the hidden layers, and the action, of (n,) or (m, n) inputs."""
        *hidden, last = exact(self.layers, self.clipped(observations), self.activation)
        return [*hidden, last if self.squash is None else self.squash(last)]

    def clipped(self, observations: np.ndarray) -> np.ndarray:
        """Return observations within the limits of the inputs."""
        return observations if self.observed is None else self.observed(observations)


def check_activation(name: str) -> None:
    """Raise MismatchError for an unknown activation."""
    if name not in ACTIVATIONS:
        raise MismatchError(f"activation {' or '.join(ACTIVATIONS)}", name)


def checked(layers: tuple[Layer, ...], activations: tuple[str, ...]) -> Mlp:
    """Return the perceptron of these layers.

    Raises
    ------
    MismatchError
        There is no hidden layer, activations differ, shapes do not fit each other, a layer is
        empty, or a number is not finite.
    """
    if not activations:
        raise MismatchError("at least one hidden layer", "none")
    if len(set(activations)) > 1:
        raise MismatchError("one activation for all hidden layers", ", ".join(activations))
    check_activation(activations[0])
    size = layers[0].weights.shape[1]
    for number, (weights, bias) in enumerate((layer.weights, layer.bias) for layer in layers):
        if weights.shape != (len(bias), size):
            wanted = f"weights of shape ({len(bias)}, {size}) in layer {number}"
            raise MismatchError(wanted, f"{weights.shape}")
        if not (np.isfinite(weights).all() and np.isfinite(bias).all()):
            raise MismatchError("finite numbers", f"NaN or infinity in layer {number}")
        if not size or not len(bias):
            raise MismatchError(f"units in layer {number}", "none")
        size = len(bias)
    return Mlp(layers, activations[0])
