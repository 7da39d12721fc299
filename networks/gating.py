"""Gates: neurons that silence populations while they fire, as a nucleus disinhibits an action.

    J = gain (e . x / R - strength r / 1 kHz) + bias

with r the mean rate of the inhibiting neurons in Hz: Nengo multiplies what goes into neurons by
their gains, so all neurons of a population fall silent alike once the strength exceeds what they
represent above threshold, in radii. The inhibition comes from several sources; one large weight
would round all others of its core to zero.

Source: nengo_spa's thalamus, whose strength this is.
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
"""Beyond the chip's one spike a step: neurons driven so fire in every step, without noise."""


def full_rate_ensemble(label: str, always: bool = False) -> nengo.Ensemble:
    """Return neurons that fire in every step while their input (1) is 1, or always, without one."""
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
        Inhibition at 1 kHz, in radii of what an ensemble represents.
    synapse : float
        Time constant in seconds; an ensemble on the chip has one, the longest of its inputs.
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
