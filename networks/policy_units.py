"""The hidden units of a policy as neurons: one or two one-dimensional ensembles each.

Neurons for z > 0 have encoders +1, neurons for z < 0 have encoders -1. Except in ``bent`` units,
they are at threshold at z = 0, and all neurons of an ensemble have the same decoder
(`spikeport.networks.solvers.Tied`). An ensemble of a ``bent`` unit has two parts with a decoder
each (`TiedInParts`), and the second is at threshold further out:

    f(z) = d_0 |z| + d_1 max(|z| - c, 0)

A unit of the first half of a layer and its counterpart in the second have the same neurons. If
these units mirror each other, as in a policy that treats left and right alike, their errors mirror
each other, too.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import nengo
import numpy as np
from nengo.utils.numpy import maxint

from spikeport.networks.at_rest import at_rest
from spikeport.networks.policy_values import PolicyOptions, Ranges
from spikeport.networks.solvers import Tied, TiedInParts

N_POINTS = 200
"""The number of values of one sign at which a decoder is solved."""

IF_TAU_RC_S = 4.0
"""Membrane time constant of the neurons called integrate-and-fire: on the chip, at steps of 1 ms, a
decay of 1 in 4,096, the least nengo-loihi allows neurons with a refractory period."""

BENT = "bent"
BENDS = np.linspace(0.05, 0.9, 18)
"""The places at which a unit may bend, as shares of its range; beyond, few values would follow."""


class Half(NamedTuple):
    """The neurons for one sign of the pre-activation of unit number ``unit``."""

    unit: int
    ensemble: nengo.Ensemble
    decoded: nengo.Connection


class HiddenLayer(nengo.Network):
    """A layer of units between ``input`` and ``output``."""

    input: nengo.Node
    output: nengo.Node
    halves: list[Half]


def hidden_layer(
    label: str, reach: Ranges, options: PolicyOptions, halves: bool, rng: np.random.RandomState
) -> HiddenLayer:
    """Return a layer of units.

    Parameters
    ----------
    label : str
        Its name.
    reach : Ranges
        The ranges of its units.
    options : PolicyOptions
        Neurons, rates and time constants.
    halves : bool
        True if ``output`` has the halves of all units (see `Readout`), not their sums.
    rng : RandomState
        Draws the seeds of the neurons.
    """
    n, signs = len(reach.above), options.function.signs
    pairs = (n + 1) // 2
    seeds = rng.randint(maxint, size=(len(signs), pairs))
    kinds, radii = _neurons(options), {+1: reach.above, -1: reach.below}
    net = HiddenLayer(label=label)
    with net:
        net.input = nengo.Node(size_in=n, label=f"{label} input")
        net.output = nengo.Node(size_in=n * len(signs) if halves else n, label=f"{label} output")
        net.halves = []
        for unit, (number, sign) in itertools.product(range(n), enumerate(signs)):
            # Units i and i + pairs mirror each other, so they have the same neurons: their
            # errors then do not turn the robot.
            seed = int(seeds[number, unit % pairs])
            ensemble, points = _ensemble(unit, sign, radii[sign][unit], kinds[sign], options, seed)
            nengo.Connection(net.input[unit], ensemble, synapse=None)
            target = net.output[unit + n * number if halves else unit]
            decoded = _decode(ensemble, target, points, options)
            net.halves.append(Half(unit, ensemble, decoded))
    return net


def _ensemble(
    unit: int,
    sign: int,
    radius: float,
    kind: nengo.neurons.NeuronType,
    options: PolicyOptions,
    seed: int,
) -> tuple[nengo.Ensemble, np.ndarray]:
    """Return a unit's neurons for one sign of its pre-activation, and evaluation points (n, 1)."""
    n = options.n_neurons // 2
    points = sign * np.linspace(0, radius, N_POINTS)[:, np.newaxis]
    ensemble = nengo.Ensemble(
        n,
        1,
        radius=radius,
        encoders=np.full((n, 1), sign),
        intercepts=_intercepts(n, points, options),
        max_rates=nengo.dists.Uniform(*options.max_rates),
        eval_points=points / radius,
        neuron_type=kind,
        label=f"unit {unit}{'+' if sign > 0 else '-'}",
        # With this seed, twin units have the same rates, whatever the network's seed.
        seed=seed,
    )
    return ensemble, points


def _intercepts(
    n: int, points: np.ndarray, options: PolicyOptions
) -> nengo.dists.Distribution | np.ndarray:
    """Return the places from which neurons fire, as shares of the range."""
    if options.units != BENT:
        return nengo.dists.Choice([0.0])
    first = n - n // 2  # as `TiedInParts` splits them: the first part is the larger
    return np.repeat([0.0, bend(options.function.function(points[:, 0]))], [first, n - first])


def bend(values: np.ndarray) -> float:
    """Return the place c at which a unit with these values (m,) over its range should bend.

        c = argmin_c min_d sum_i (d_0 z_i + d_1 max(z_i - c, 0) - f_i)^2

    It is a share of the range, one of `BENDS`; ``values`` f are those at m points z from 0 to 1.
    """
    z = np.linspace(0, 1, len(values))
    hinges = np.maximum(z - BENDS[:, np.newaxis], 0)
    lines = np.stack([np.broadcast_to(z, hinges.shape), hinges], axis=2)
    across = lines.transpose(0, 2, 1)
    decoders = np.linalg.solve(across @ lines, (across @ values)[..., np.newaxis])
    errors = ((lines @ decoders)[..., 0] - values) ** 2
    return float(BENDS[errors.sum(axis=1).argmin()])


def _decode(
    ensemble: nengo.Ensemble, target: nengo.Node, points: np.ndarray, options: PolicyOptions
) -> nengo.Connection:
    return nengo.Connection(
        ensemble,
        target,
        function=options.function.function(points),
        eval_points=points,
        scale_eval_points=False,
        solver=TiedInParts(min(2, ensemble.n_neurons)) if options.units == BENT else Tied(),
        synapse=None,
    )


def _neurons(options: PolicyOptions) -> dict[int, nengo.neurons.NeuronType]:
    """Return the neuron type for each sign."""
    above, below = _KINDS[options.units]
    return {+1: above(options), -1: below(options)}


def _lif(options: PolicyOptions) -> nengo.LIF:
    return nengo.LIF(tau_ref=options.tau_ref, initial_state=at_rest())


def _relu(_options: PolicyOptions) -> nengo.SpikingRectifiedLinear:
    return nengo.SpikingRectifiedLinear(initial_state=at_rest())


def _integrate_and_fire(options: PolicyOptions) -> nengo.LIF:
    return nengo.LIF(tau_rc=IF_TAU_RC_S, tau_ref=options.tau_ref, initial_state=at_rest())


_Kind = Callable[[PolicyOptions], nengo.neurons.NeuronType]
_KINDS: dict[str, tuple[_Kind, _Kind]] = {
    "hybrid": (_relu, _lif),
    "lif": (_lif, _lif),
    "relu": (_relu, _relu),
    "if": (_integrate_and_fire, _integrate_and_fire),
    BENT: (_relu, _relu),
}
