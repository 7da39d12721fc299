r"""Weights between layers of spiking units, solved for against what is exact.

.. math:: W = W_0 + \arg\min_\Delta |F \Delta^T + 1 c^T - (Y - F W_0^T)|^2
              + m (\lambda \max F)^2 |\Delta|^2

``F`` (m, n) is what the halves of units put out for m observations, ``Y`` (m, d) what the next
layer should get, and ``W_0`` the weights of the multilayer perceptron, to which halves that the
observations say nothing of keep.
"""

from collections.abc import Sequence

import nengo
import numpy as np
from nengo.utils.ensemble import tuning_curves

from spikeport.networks.policy_units import HiddenLayer
from spikeport.networks.policy_values import Layer, PolicyOptions, Readout, exact

REGULARISATION = 0.003
"""Lambda, as of `nengo.solvers.LstsqL2`; of gait that was not fitted, it leaves the least error."""


def by_halves(layer: Layer, options: PolicyOptions) -> Readout:
    """Return the same layer, reading the halves of units by themselves."""
    return Readout(np.tile(layer.weights, len(options.function.signs)), layer.bias)


def refit(nominal: Readout, halves: np.ndarray, wanted: np.ndarray) -> Readout:
    """Return the read-out of recorded halves (m, n) that comes nearest to wanted values (m, d)."""
    missing = wanted - halves @ nominal.weights.T
    centre, bias = halves.mean(axis=0), missing.mean(axis=0)
    solver = nengo.solvers.LstsqL2(reg=REGULARISATION)
    change, _ = solver(halves - centre, missing - bias)
    return Readout(nominal.weights + change.T, bias - centre @ change)


def solve_layers(
    net: nengo.Network, layers: Sequence[Layer], options: PolicyOptions, observations: np.ndarray
) -> list[Layer]:
    """Return the layers; those after the first are solved for on the neurons' tuning curves.

    Parameters
    ----------
    net : PolicyNetwork
        The policy, its ``layers`` with outputs by halves.
    layers : sequence of Layer
        The layers of the multilayer perceptron.
    options : PolicyOptions
        The options of the policy.
    observations : (m, n) array
        Recorded observations.
    """
    values = exact(layers, observations, options.activation)
    with nengo.Simulator(net, progress_bar=False, optimize=False) as sim:
        halves = [_halves(*pair, sim) for pair in zip(net.layers, values[:-1], strict=True)]
    solved = [
        refit(by_halves(layer, options), *pair)
        for layer, *pair in zip(layers[1:], halves, values[1:], strict=True)
    ]
    return [layers[0], *solved]


def _halves(hidden: HiddenLayer, z: np.ndarray, sim: nengo.Simulator) -> np.ndarray:
    """Return the halves' output, (m, n_halves * n), for pre-activations (m, n) that are held."""
    found = np.zeros((len(z), hidden.output.size_in))
    for half in hidden.halves:
        _, rates = tuning_curves(half.ensemble, sim, inputs=z[:, [half.unit]])
        found[:, half.decoded.post_slice] = rates @ sim.data[half.decoded].weights.T
    return found
