"""Gates: neurons that silence populations while they fire, as a nucleus disinhibits an action.

    J = gain (e . x / R - strength r / 1 kHz) + bias

with r the mean rate of the inhibiting neurons in Hz. Nengo multiplies the input of neurons by their
gains, so the gains do not matter: a neuron falls silent once the inhibition exceeds the part of
e . x / R that is above its intercept. The inhibition comes from several sources, since one large
weight would round all other weights of its core to zero.

Source: nengo_spa's thalamus, which has the default strength.
"""

from collections.abc import Iterable

import nengo
import numpy as np
from nengo.base import ObjView
from nengo_spa.modules.thalamus import Thalamus

from spikeport.networks.at_rest import at_rest

FULL_RATE_HZ = 1000.0
"""The rate of a closed gate: its neurons fire in every step."""
FULL_RATE_NEURONS = 8
DRIVEN_HZ = 1020.0
"""A rate above the chip's one spike a step: neurons at it fire in every step, without noise."""


def full_rate_ensemble(label: str, always: bool = False) -> nengo.Ensemble:
    """Return neurons that fire in every step while their scalar input is 1, or always."""
    n, rates = FULL_RATE_NEURONS, np.full(FULL_RATE_NEURONS, DRIVEN_HZ)
    return nengo.Ensemble(
        n,
        1,
        encoders=np.ones((n, 1)),
        gain=rates,
        bias=rates if always else np.zeros(n),
        # Neurons without input have their decoders solved at one point.
        eval_points=np.zeros((1, 1)) if always else nengo.Default,
        neuron_type=nengo.SpikingRectifiedLinear(initial_state=at_rest()),
        label=label,
    )


def gate(
    inhibitor: ObjView,
    ensembles: Iterable[nengo.Ensemble],
    strength: float = Thalamus.route_inhibit.default,
    synapse: float = 0.005,
) -> None:
    """Silence ensembles while some neurons fire.

    Parameters
    ----------
    inhibitor : ObjView
        The neurons, such as ``selection.nuclei["gate"][action]``.
    ensembles : iterable of nengo.Ensemble
        The ensembles to silence.
    strength : float
        Inhibition at 1 kHz, in radii of an ensemble.
    synapse : float
        Time constant in seconds; an ensemble on the chip has only one, the longest of its inputs'.
    """
    n_sources = inhibitor.size_out
    for ensemble in ensembles:
        nengo.Connection(
            inhibitor,
            ensemble.neurons,
            transform=np.full(
                (ensemble.n_neurons, n_sources), -strength / (n_sources * FULL_RATE_HZ)
            ),
            synapse=synapse,
            label=f"gate of {ensemble.label}",
        )
