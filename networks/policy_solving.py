r"""Weights between layers of spiking units, solved to match the exact values.

.. math:: W = W_0 + \arg\min_\Delta |F \Delta^T + 1 c^T - (Y - F W_0^T)|^2
              + m (\lambda \max (F - 1 \bar F^T))^2 |\Delta|^2

``F`` (m, n) is the output of the units' halves for m observations, with means :math:`\bar F`,
``Y`` (m, d) the target input of the next layer, and ``W_0`` the weights of the multilayer
perceptron. Halves whose output the observations do not change keep these weights.
"""

from collections.abc import Sequence

import nengo
import numpy as np
from nengo.utils.ensemble import tuning_curves

from spikeport.networks.policy_units import HiddenLayer
from spikeport.networks.policy_values import Layer, PolicyOptions, Readout, exact

REGULARISATION = 0.003
"""Lambda, as in `nengo.solvers.LstsqL2`: it leaves the least error on gait that was not fitted."""


def by_halves(layer: Layer, options: PolicyOptions) -> Readout:
    """Return a copy of the layer that reads the halves of units separately."""
    return Readout(np.tile(layer.weights, len(options.function.signs)), layer.bias)


def refit(nominal: Readout, halves: np.ndarray, wanted: np.ndarray) -> Readout:
    """Return the read-out of recorded halves (m, n) that comes nearest to target values (m, d)."""
    missing = wanted - halves @ nominal.weights.T
    centre, bias = halves.mean(axis=0), missing.mean(axis=0)
    solver = nengo.solvers.LstsqL2(reg=REGULARISATION)
    change, _ = solver(halves - centre, missing - bias)
    return Readout(nominal.weights + change.T, bias - centre @ change)


def solve_layers(
    net: nengo.Network, layers: Sequence[Layer], options: PolicyOptions, observations: np.ndarray
) -> list[Layer]:
    """Return the layers, with all after the first solved on the neurons' tuning curves.

    Parameters
    ----------
    net : PolicyNetwork
        The policy, whose ``layers`` output their halves separately.
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
    """Return the halves' output, (m, n_halves * n), for constant pre-activations (m, n)."""
    found = np.zeros((len(z), hidden.output.size_in))
    for half in hidden.halves:
        _, rates = tuning_curves(half.ensemble, sim, inputs=z[:, [half.unit]])
        found[:, half.decoded.post_slice] = rates @ sim.data[half.decoded].weights.T
    return found
