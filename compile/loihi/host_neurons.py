"""The host's neurons that send values to the chip as spikes, one pair a dimension.

nengo-loihi's pairs average one spike a step, whatever the value. Pairs here are at threshold at
zero, and send a value's distance from zero:

    J_on = max(x, 0) / (w dt),   J_off = max(-x, 0) / (w dt)         (in Hz)

with w the value that a spike in every step stands for. The chip weighs a spike w times as much, so
that the current has the same mean.
"""

import contextlib
from collections.abc import Iterator

import nengo
import numpy as np
from nengo.ensemble import Neurons
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons


class SparseInputNeurons(OnOffDecodeNeurons):
    """Pairs of host neurons that are silent at zero.

    Parameters
    ----------
    dt : float
        The time step, in seconds.
    weight : float
        The value, in units of the target's radius, that a spike in every step stands for.
    """

    def __init__(self, dt: float, weight: float) -> None:
        super().__init__(dt=dt, rate=1 / (weight * dt), is_input=True)
        self.gain = np.full(2, self.rate)  # of the on neuron and of the off neuron
        self.bias = np.zeros(2)


@contextlib.contextmanager
def weighted(model: Model, connection: nengo.Connection) -> Iterator[None]:
    """Build a connection from the host, and weigh its spikes.

    nengo-loihi weighs spikes of host neurons where they reach encoders, but not where they reach
    neurons.
    """
    if isinstance(connection.pre_obj, Neurons) or not isinstance(connection.post_obj, Neurons):
        yield
        return
    target = model.objs[connection.post_obj]["in"]
    n_before = len(target.synapses)
    yield
    for synapse in target.synapses[n_before:]:
        synapse.weights = [w * np.float32(model.node_neurons.scale) for w in synapse.weights]
