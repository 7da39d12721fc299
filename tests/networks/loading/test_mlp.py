"""Perceptrons: layers that fit together, and one activation."""

import numpy as np
import pytest

from spikeport.networks.loading.mlp import checked
from spikeport.networks.policy_values import Layer
from spikeport.reading.mismatch import MismatchError


def layer(n_out: int, n_in: int, value: float = 1.0) -> Layer:
    return Layer(np.full((n_out, n_in), value), np.zeros(n_out))


def test_sizes_are_those_of_inputs_and_of_every_layer() -> None:
    assert checked((layer(4, 3), layer(2, 4)), ("tanh",)).sizes == (3, 4, 2)


@pytest.mark.parametrize(
    ("layers", "activations", "message"),
    [
        ((layer(4, 3),), (), "expected at least one hidden layer, found none"),
        (
            (layer(4, 3), layer(4, 4), layer(1, 4)),
            ("elu", "relu"),
            "expected one activation for all hidden layers, found elu, relu",
        ),
        (
            (layer(4, 3), layer(2, 5)),
            ("elu",),
            "expected weights of shape (2, 4) in layer 1, found (2, 5)",
        ),
        (
            (layer(4, 3), layer(2, 4, np.nan)),
            ("elu",),
            "expected finite numbers, found NaN or infinity in layer 1",
        ),
    ],
)
def test_layers_that_make_no_perceptron_are_refused(
    layers: tuple[Layer, ...], activations: tuple[str, ...], message: str
) -> None:
    with pytest.raises(MismatchError) as caught:
        checked(layers, activations)
    assert str(caught.value) == message
