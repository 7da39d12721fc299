"""A multilayer perceptron as a spiking network, unit by unit (paper, sec. 3.2.1).

    h = f(z),  z = W h_before + b

A hidden unit is two one-dimensional ensembles. By default, as in the paper, they are spiking
rectified linear neurons for z > 0 and LIF neurons for z < 0 (`spikeport.networks.policy_units`).
Between layers the values are filtered by a low-pass synapse.
"""

from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.errors import UsageError
from spikeport.networks.policy_solving import by_halves, solve_layers
from spikeport.networks.policy_units import HiddenLayer, hidden_layer
from spikeport.networks.policy_values import (
    Calibrated,
    Layer,
    PolicyOptions,
    Ranges,
    Readout,
    exact,
    record_ranges,
)
from spikeport.node_functions import Affine, Held

__all__ = [
    "Calibrated",
    "Layer",
    "PolicyNetwork",
    "PolicyOptions",
    "Ranges",
    "Readout",
    "exact",
    "policy",
    "record_ranges",
    "solved_layers",
]

OFF_CENTRE = 0.5
"""Share of a unit's range above which biases of the first layer are added on the host. The
host sends only values within the range: without a bias of half the range, half of the sums would be
lost."""


class PolicyNetwork(nengo.Network):
    """A policy with the input ``observation``, the output ``action``, and its hidden ``layers``."""

    observation: nengo.Node
    action: nengo.Node
    layers: list[HiddenLayer]


def policy(
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    options: PolicyOptions | None = None,
    seed: int = 0,
    calibrated: Calibrated | None = None,
    observations: np.ndarray | None = None,
) -> PolicyNetwork:
    """Build the spiking network.

    Parameters
    ----------
    layers : sequence of Layer
        Hidden layers, and the layer of the action.
    ranges : sequence of Ranges
        The ranges of the hidden layers, see `record_ranges`.
    options : PolicyOptions, optional
        Activation, neurons, rates and time constants.
    seed : int
        Seed of the neurons.
    calibrated : Calibrated, optional
        Changes of the first and the last layer that fit them to the neurons where they run
        (`spikeport.experiments.policy.calibration`).
    observations : (m, n) array, optional
        Recorded observations, for ``solve="layer"``.

    Raises
    ------
    UsageError
        If layers are to be solved without observations, or a hidden layer has no ranges.
    """
    options = options or PolicyOptions()
    if len(ranges) != len(layers) - 1:
        raise UsageError(
            f"{len(ranges)} ranges for {len(layers) - 1} hidden layers; cure: "
            "record_ranges(layers, observations)"
        )
    solved = solved_layers(layers, ranges, options, seed, observations)
    return _network(calibrated.of(solved) if calibrated else solved, ranges, options, seed)


def solved_layers(
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    options: PolicyOptions,
    seed: int,
    observations: np.ndarray | None,
) -> list[Layer]:
    """Return the layers that connect the neurons, see `policy`.

    Raises
    ------
    UsageError
        If layers are solved together, and there are no observations to solve them on.
    """
    if options.solve == "unit":
        return list(layers)
    if observations is None:
        raise UsageError("solve='layer' needs recorded observations; give them to policy()")
    halved = [layers[0], *(by_halves(layer, options) for layer in layers[1:])]
    # In a network of its own: one under construction would keep these neurons, too.
    with nengo.Network(add_to_container=False):
        net = _network(halved, ranges, options, seed)
    return solve_layers(net, layers, options, observations)


def _network(
    layers: Sequence[Layer], ranges: Sequence[Ranges], options: PolicyOptions, seed: int
) -> PolicyNetwork:
    rng = np.random.RandomState(seed)
    net = PolicyNetwork(label="policy", seed=seed)
    with net:
        n_in, n_out = layers[0].weights.shape[1], len(layers[-1].bias)
        net.observation = nengo.Node(size_in=n_in, label="observation")
        net.action = nengo.Node(Affine(), size_in=n_out, label="action")
        net.layers = []
        # The first weights are applied on the host, where the observation is: there is nothing to
        # filter.
        values, synapse = net.observation, None
        for number, (layer, reach) in enumerate(zip(layers[:-1], ranges, strict=True)):
            # A read-out that weighs the two signs separately needs the value of each, not their
            # sum.
            halves = isinstance(layers[number + 1], Readout)
            hidden = hidden_layer(f"layer {number + 1}", reach, options, halves, rng)
            signs = options.function.signs
            if number == 0 and options.observes_host and _is_off_centre(layer, reach, signs):
                _on_host(values, hidden.input, layer)
            elif number == 0:
                _from_host(values, hidden, layer)
            else:
                _dense(values, hidden.input, layer, synapse)
            net.layers.append(hidden)
            values, synapse = hidden.output, options.tau_fwd
        _dense(values, net.action, layers[-1], options.tau_out)
    return net


def _is_off_centre(layer: Layer, reach: Ranges, signs: Sequence[int]) -> bool:
    """Return whether the host can only send a layer's sums with their biases, for halves of signs.

    A half of the range r gets its sum s within +- r, and z = s + b. A bias shifts the sums of the
    half on the other side of zero out of +- r. On its own side, a bias above r would drive the half
    even with the least sum that is sent, however far z is on the other side.
    """
    size, rises = np.abs(layer.bias), layer.bias > 0
    # ReLU has no neurons below zero, and nothing that a bias could drive.
    below = reach.below if -1 in signs else np.inf
    own, other = np.where(rises, reach.above, below), np.where(rises, reach.below, reach.above)
    return bool(((size > OFF_CENTRE * other) | (size > own)).any())


def _on_host(pre: nengo.Node, post: nengo.Node, layer: Layer) -> None:
    """Connect as `_dense` does, but compute the sums on the host, bias included."""
    sums = nengo.Node(
        Held(lambda x: layer.weights @ x + layer.bias),
        size_in=pre.size_out,
        size_out=post.size_in,
        label=f"sums of {post.label}",
    )
    nengo.Connection(pre, sums, synapse=None)
    nengo.Connection(sums, post, synapse=None)


def _from_host(pre: nengo.Node, hidden: HiddenLayer, layer: Layer) -> None:
    """Connect as `_dense` does, from the host, but give biases to the neurons themselves.

    In a sum that the host sends, biases would stay in it, and be no biases of neurons.
    """
    bias = nengo.Node(layer.bias, label=f"bias of {hidden.input.label}")
    for half in hidden.halves:
        nengo.Connection(bias[half.unit], half.ensemble, synapse=None)
    nengo.Connection(pre, hidden.input, transform=layer.weights, synapse=None)


def _dense(pre: nengo.Node, post: nengo.Node, layer: Layer, synapse: float | None) -> None:
    bias = nengo.Node(layer.bias, label=f"bias of {post.label}")
    nengo.Connection(bias, post, synapse=None)
    nengo.Connection(pre, post, transform=layer.weights, synapse=synapse)
