"""Populations of spiking rectified linear neurons that compute one kinked line each.

    f(x) = slope [x - threshold]+

The neurons of a population have one threshold, spread gains and one decoder
(`spikeport.networks.solvers.Tied`). Several such populations are one ensemble, with a dimension for
each.
"""

from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.at_rest import at_rest
from spikeport.networks.solvers import PerDimension, Tied

N_POINTS = 100
"""Values at which a decoder is solved."""


@dataclass(frozen=True)
class Rectified:
    """A population.

    Attributes
    ----------
    threshold, slope : float
        The parameters of the line.
    full : float
        The value at which neurons fire at the chosen rates.
    n_neurons : int
        Neurons of a population.
    rates : tuple of float
        Rates in Hz are drawn uniformly from these.
    switches : bool
        True if the decoder is solved at ``full`` alone: for populations that are mostly silent, or
        fire in every step of the chip.
    """

    threshold: float
    slope: float
    full: float
    n_neurons: int
    rates: tuple[float, float]
    switches: bool = False

    def ensemble(
        self, n: int, radius: float, rng: np.random.RandomState, label: str
    ) -> nengo.Ensemble:
        """Return n populations: the neurons of the i-th are [i n_neurons, (i + 1) n_neurons).

        ``radius`` matters for values from the host, which are clipped to it.
        """
        total = n * self.n_neurons
        per_unit = rng.uniform(*self.rates, total) / (self.full - self.threshold)
        return nengo.Ensemble(
            total,
            n,
            radius=radius,
            encoders=np.repeat(np.eye(n), self.n_neurons, axis=0),
            gain=per_unit * radius,
            bias=-per_unit * self.threshold,
            neuron_type=nengo.SpikingRectifiedLinear(initial_state=at_rest()),
            label=label,
        )

    def decoding(self, n: int, weights: bool) -> dict[str, object]:
        """Return the function and solver of a connection from ``n`` populations, as its arguments.

        ``weights`` is True if it is wired from neuron to neuron.
        """
        first = self.full if self.switches else self.threshold
        points = np.repeat(np.linspace(first, self.full, N_POINTS)[:, np.newaxis], n, axis=1)
        return {
            "function": self.slope * (points - self.threshold),
            "eval_points": points,
            "scale_eval_points": False,
            "solver": PerDimension(self.n_neurons, Tied(), weights=weights),
        }
