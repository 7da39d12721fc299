"""Rule SP417: neurons on the host that spike several times in a step; the chip gets one spike.

The types in `MOST` spike several times in a step of dt if their rate r is high. Other types, such
as `nengo.LIF`, spike at most once. Spikes are lost if

    r dt > 1,    or r dt > 0.1 for nengo.PoissonSpiking, which then loses more than one in 20
"""

from collections.abc import Iterator

import nengo
import numpy as np
from nengo.dists import get_samples

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.scope import Scope

MOST = {
    nengo.SpikingRectifiedLinear: 1.0,
    nengo.RegularSpiking: 1.0,
    nengo.StochasticSpiking: 1.0,
    nengo.PoissonSpiking: 0.1,
}
"""Mean number of spikes in a step up to which hardly any spike is lost, by type of neurons."""


def host_neuron_hints(scope: Scope, dt_s: float) -> Iterator[Violation]:
    """Yield a hint on each connection from neurons on the host that spike several times in a step.

    Rates are those at the radius. Neurons that a connection drives directly may have higher rates.
    """
    for connection in scope.from_host_neurons():
        ensemble = connection.pre_obj.ensemble
        most = MOST.get(type(ensemble.neuron_type), np.inf)
        highest_hz = _highest_hz(ensemble) if np.isfinite(most) else 0.0
        if highest_hz * dt_s > most:
            used, limit = f"up to {highest_hz:,.0f} Hz", f"{most / dt_s:,.0f} Hz"
            yield rules.get("SP417").broken(scope.names[connection], used, limit)


def _highest_hz(ensemble: nengo.Ensemble) -> float:
    """Return the highest rate of an ensemble's neurons at its radius."""
    n, rng = ensemble.n_neurons, np.random.RandomState(0)
    if ensemble.gain is None:
        return float(get_samples(ensemble.max_rates, n, rng=rng).max())
    gain, bias = (get_samples(one, n, rng=rng) for one in (ensemble.gain, ensemble.bias))
    rates = getattr(ensemble.neuron_type, "base_type", nengo.RectifiedLinear()).rates
    return float(rates(np.repeat([[-1.0], [1.0]], n, axis=1), gain, bias).max())
