"""A network on Nengo's own simulator, in float."""

from typing import ClassVar

import nengo
import numpy as np
import scipy.sparse
from traffic import Running, Traffic, contest


class IntegrateAndFire(nengo.neurons.NeuronType):
    """Neurons that integrate their input and fire; thresholds and counts are class attributes."""

    spiking = True
    state: ClassVar = {"voltage": nengo.dists.Choice([0])}
    vth = np.zeros(0)
    count = np.zeros(0, dtype=int)

    def max_rates_intercepts(self, gain, bias):
        """Return zeros: no decoder is solved."""
        return np.zeros_like(gain), np.zeros_like(bias)

    def step(self, dt, J, output, voltage):
        """Advance by a step."""
        voltage += J
        fires = voltage > self.vth
        voltage[fires] = 0
        output[:] = fires / dt
        self.count[:] += fires


def build(traffic: Traffic) -> Running:
    """Build the network."""
    IntegrateAndFire.vth = traffic.vth
    IntegrateAndFire.count = count = np.zeros(traffic.n, dtype=int)
    shape = (traffic.n, traffic.n)
    entries = traffic.weight.astype(float), (traffic.target, traffic.source)
    weights = scipy.sparse.csr_matrix(entries, shape)
    with nengo.Network() as network:
        group = nengo.Ensemble(
            traffic.n,
            1,
            neuron_type=IntegrateAndFire(),
            gain=np.ones(traffic.n),
            bias=traffic.bias,
        ).neurons
        transform = weights.toarray() if traffic.is_dense else nengo.Sparse(shape, init=weights)
        nengo.Connection(group, group, transform=transform, synapse=0)
    # a step of 1 s: a spike is 1, not 1 / dt, and sums stay exact
    simulator = nengo.Simulator(network, dt=1.0, progress_bar=False)
    return Running(simulator.run_steps, lambda: count)


contest(f"Nengo {nengo.__version__}", build)
