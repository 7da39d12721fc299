import math

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.networks.activations import ACTIVATIONS, activation

SCALARS = {
    "elu": lambda z: z if z > 0 else math.exp(z) - 1,
    "relu": lambda z: max(z, 0.0),
    "tanh": math.tanh,
    "silu": lambda z: z / (1 + math.exp(-z)),
    "gelu": lambda z: z * 0.5 * (1 + math.erf(z / math.sqrt(2))),
}


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_values_are_exact(name):
    z = np.array([-3.0, -1.0, -0.1, 0.0, 0.2, 1.0, 2.5])
    wanted = [SCALARS[name](value) for value in z]
    np.testing.assert_allclose(activation(name).function(z), wanted, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_the_signs_are_those_where_the_activation_is_not_zero(name):
    found = tuple(s for s in (1, -1) if activation(name).function(np.array(0.5 * s)) != 0)
    assert activation(name).signs == found


@pytest.mark.parametrize("name", ACTIVATIONS)
def test_large_pre_activations_give_finite_values(name):
    assert np.isfinite(activation(name).function(np.array([-1e4, 1e4]))).all()


def test_an_unknown_activation_lists_the_known_ones():
    with pytest.raises(UsageError) as caught:
        activation("swish")
    message = "unknown activation 'swish'; choose from: elu, gelu, relu, silu, tanh"
    assert str(caught.value) == message
