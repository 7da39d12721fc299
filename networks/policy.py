"""A multilayer perceptron with ELU units as a spiking network, unit by unit (paper, sec. 3.2.1).

    h = ELU(z),  z = W h_before + b

Every hidden unit is two one-dimensional ensembles: spiking rectified linear neurons for z > 0, LIF
neurons for z < 0, both at threshold at z = 0, with encoders +1 and -1. Between layers the values
are filtered by a low-pass synapse.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.solvers import Tied

N_POINTS = 200
"""Values of a half space at which its decoder is solved."""


@dataclass(frozen=True)
class Layer:
    """A dense layer: ``weights`` (n_out, n_in) and ``bias`` (n_out,)."""

    weights: np.ndarray
    bias: np.ndarray


@dataclass(frozen=True)
class Ranges:
    """How far the pre-activations of a layer's units reach, (n,) each, both positive."""

    above: np.ndarray
    below: np.ndarray


@dataclass(frozen=True)
class PolicyOptions:
    """Neurons of a unit, half of them for each sign; rates in Hz; time constants in seconds."""

    n_neurons: int = 20
    tau_fwd: float = 0.002
    tau_out: float = 0.005
    max_rates: tuple[float, float] = (400.0, 800.0)
    tau_ref: float = 0.001


class PolicyNetwork(nengo.Network):
    """``observation`` is its input, ``action`` its output; ``layers`` its hidden layers."""

    observation: nengo.Node
    action: nengo.Node
    layers: list[nengo.Network]


def elu(z: np.ndarray) -> np.ndarray:
    """The exponential linear unit: z where positive, else exp(z) - 1."""
    return np.where(z > 0, z, np.expm1(np.minimum(z, 0)))


def exact(layers: Sequence[Layer], observation: np.ndarray) -> list[np.ndarray]:
    """Pre-activations of every layer, the last being the action, for (..., n) observations."""
    values, found = np.asarray(observation), []
    for layer in layers:
        found.append(values @ layer.weights.T + layer.bias)
        values = elu(found[-1])
    return found


def record_ranges(
    layers: Sequence[Layer],
    observations: np.ndarray,
    quantile: float = 0.995,
    floor: float = 0.5,
) -> list[Ranges]:
    """Ranges of all hidden units, for each sign, on recorded (n_samples, n) observations.

    Error grows with the range, so it is a quantile of what occurs, and not the utmost.
    """
    hidden = exact(layers, observations)[:-1]
    return [
        Ranges(
            np.maximum(np.quantile(z, quantile, axis=0), floor),
            np.maximum(np.quantile(-z, quantile, axis=0), floor),
        )
        for z in hidden
    ]


def policy(
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    options: PolicyOptions | None = None,
    seed: int = 0,
) -> PolicyNetwork:
    """Build the spiking network.

    Parameters
    ----------
    layers : sequence of Layer
        Hidden layers, and the layer of the action.
    ranges : sequence of Ranges
        Of the hidden layers, see `record_ranges`.
    options : PolicyOptions, optional
        Neurons, rates and time constants.
    seed : int
        Seed of the neurons.
    """
    options = options or PolicyOptions()
    with PolicyNetwork(label="policy", seed=seed) as net:
        n_in, n_out = layers[0].weights.shape[1], len(layers[-1].bias)
        net.observation = nengo.Node(size_in=n_in, label="observation")
        net.action = nengo.Node(lambda _t, x: x, size_in=n_out, label="action")
        net.layers = []
        values, synapse = net.observation, None
        for number, (layer, reach) in enumerate(zip(layers[:-1], ranges, strict=True)):
            hidden = _hidden(f"layer {number + 1}", reach, options)
            _dense(values, hidden.input, layer, synapse)
            net.layers.append(hidden)
            values, synapse = hidden.output, options.tau_fwd
        _dense(values, net.action, layers[-1], options.tau_out)
    return net


def _dense(pre: nengo.Node, post: nengo.Node, layer: Layer, synapse: float | None) -> None:
    bias = nengo.Node(layer.bias, label=f"bias of {post.label}")
    nengo.Connection(bias, post, synapse=None)
    nengo.Connection(pre, post, transform=layer.weights, synapse=synapse)


class _Hidden(nengo.Network):
    """A layer of units between ``input`` and ``output``."""

    input: nengo.Node
    output: nengo.Node


def _hidden(label: str, reach: Ranges, options: PolicyOptions) -> _Hidden:
    n = len(reach.above)
    with _Hidden(label=label) as net:
        net.input = nengo.Node(size_in=n, label=f"{label} input")
        net.output = nengo.Node(size_in=n, label=f"{label} output")
        above = nengo.SpikingRectifiedLinear(initial_state=_at_rest())
        below = nengo.LIF(tau_ref=options.tau_ref, initial_state=_at_rest())
        for unit in range(n):
            for sign, kind, radius in (
                (+1, above, reach.above[unit]),
                (-1, below, reach.below[unit]),
            ):
                _half(net, unit, sign, kind, radius, options)
    return net


def _half(
    net: _Hidden,
    unit: int,
    sign: int,
    kind: nengo.neurons.NeuronType,
    radius: float,
    options: PolicyOptions,
) -> None:
    """The neurons of one unit for one sign of its pre-activation."""
    n = options.n_neurons // 2
    points = sign * np.linspace(0, radius, N_POINTS)[:, np.newaxis]
    ensemble = nengo.Ensemble(
        n,
        1,
        radius=radius,
        encoders=np.full((n, 1), sign),
        intercepts=nengo.dists.Choice([0.0]),
        max_rates=nengo.dists.Uniform(*options.max_rates),
        eval_points=points / radius,
        neuron_type=kind,
        label=f"unit {unit}{'+' if sign > 0 else '-'}",
    )
    nengo.Connection(net.input[unit], ensemble, synapse=None)
    nengo.Connection(
        ensemble,
        net.output[unit],
        function=elu(points),
        eval_points=points,
        scale_eval_points=False,
        solver=Tied(),
        synapse=None,
    )


def _at_rest() -> dict[str, nengo.dists.Distribution]:
    """On the chip all neurons start at zero."""
    return {"voltage": nengo.dists.Choice([0])}
