"""The spiking network of a perceptron that was read from a file."""

from dataclasses import replace

import nengo
import numpy as np

from spikeport.networks.activations import activation
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.policy import PolicyNetwork, PolicyOptions, policy, record_ranges
from spikeport.networks.policy_values import Ranges, check_observations
from spikeport.node_functions import Held


def perceptron(
    mlp: Mlp, observations: np.ndarray, options: PolicyOptions | None = None, seed: int = 0
) -> PolicyNetwork:
    """Build the spiking network of a perceptron; the host computes what is around its layers.

    Parameters
    ----------
    mlp : Mlp
        The perceptron, as `spikeport.networks.loading.files.load_mlp` returns it.
    observations : (m, n) array
        Recorded observations, from which the ranges of the units are taken.
    options : PolicyOptions, optional
        Neurons, rates and time constants; the activation is always the perceptron's. The default is
        `options_for`.
    seed : int
        Seed of the neurons.

    Raises
    ------
    UsageError
        If the observations are not finite numbers, or not as many a row as the perceptron has
        inputs.
    """
    options = replace(options or options_for(mlp), activation=mlp.activation)
    if mlp.observed is not None:  # the host clips what the first layer observes
        options = replace(options, observes_host=True)
    ranges = ranges_of(mlp, observations)
    net = policy(mlp.layers, ranges, options, seed, observations=mlp.clipped(observations))
    with net:
        if mlp.observed is not None:
            inside, n = net.observation, net.observation.size_in
            net.observation = nengo.Node(Held(mlp.observed), size_in=n, label="observation")
            inside.label = "clipped observation"
            nengo.Connection(net.observation, inside, synapse=None)
        if mlp.squash is not None:
            inside, n = net.action, net.action.size_in
            net.action = nengo.Node(Held(mlp.squash), size_in=n, label="action")
            inside.label = "last layer"
            nengo.Connection(inside, net.action, synapse=None)
    return net


def ranges_of(mlp: Mlp, observations: np.ndarray) -> list[Ranges]:
    """Return the ranges of the units of every hidden layer; see `perceptron`."""
    check_observations(observations, mlp.sizes[0])
    inputs = mlp.clipped(observations)
    return record_ranges(mlp.layers, inputs, activation_name=mlp.activation)


def options_for(
    mlp: Mlp,
    n_neurons: int = PolicyOptions.n_neurons,
    tau_fwd: float = PolicyOptions.tau_fwd,
) -> PolicyOptions:
    """Return options with the units that compute a perceptron's activation best.

    ``n_neurons`` and ``tau_fwd`` are those of `PolicyOptions`; raises UsageError as it does.
    """
    units = activation(mlp.activation).units
    return PolicyOptions(n_neurons, tau_fwd, activation=mlp.activation, units=units)
