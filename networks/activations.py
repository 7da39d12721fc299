"""Nonlinearities of a policy's units, by name, and the signs of z for which they are not zero.

elu = z for z > 0, exp(z) - 1 below;    relu = max(z, 0);    tanh = tanh(z)
silu = z / (1 + exp(-z));    gelu = z Phi(z), Phi the normal distribution function

Each is 0 at z = 0, where the neurons of both signs are at threshold.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import expit, ndtr

from spikeport.arrays import Floats
from spikeport.errors import unknown


class Activation(NamedTuple):
    """A function of pre-activations.

    ``signs`` are the signs of z that need neurons, ``units`` the neurons that compute it best (see
    `spikeport.networks.policy_values.PolicyOptions`).
    """

    function: Callable[[Floats], Floats]
    signs: tuple[int, ...] = (+1, -1)
    units: str = "hybrid"


def elu(z: Floats) -> Floats:
    """Return the exponential linear unit: z where positive, else exp(z) - 1."""
    return np.where(z > 0, z, np.expm1(np.minimum(z, 0)))


def relu(z: Floats) -> Floats:
    """Return the rectified linear unit: z where positive, else 0."""
    return np.maximum(z, 0.0)


def silu(z: Floats) -> Floats:
    """Return the sigmoid-weighted linear unit; its least value is -0.278, at z = -1.278."""
    value: Floats = z * expit(z)
    return value


def gelu(z: Floats) -> Floats:
    """Return the Gaussian error linear unit, exact; its least value is -0.170, at z = -0.752."""
    value: Floats = z * ndtr(z)
    return value


ACTIVATIONS = {
    "elu": Activation(elu),
    "relu": Activation(relu, signs=(+1,)),
    "tanh": Activation(np.tanh, units="bent"),
    "silu": Activation(silu, units="bent"),
    "gelu": Activation(gelu, units="bent"),
}


def activation(name: str) -> Activation:
    """Return the activation of a name; raise UsageError with the known names for any other."""
    if name not in ACTIVATIONS:
        raise unknown("activation", name, ACTIVATIONS)
    return ACTIVATIONS[name]
