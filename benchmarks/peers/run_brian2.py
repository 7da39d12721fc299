"""A network on brian2, with generated Cython code."""

import brian2
import numpy as np
from brian2 import Network, NeuronGroup, SpikeMonitor, Synapses, ms
from traffic import Running, Traffic, contest


def build(traffic: Traffic) -> Running:
    """Build the network."""
    brian2.prefs.codegen.target = "cython"
    brian2.defaultclock.dt = 1 * ms
    group = NeuronGroup(
        traffic.n, "v : 1\nq : 1\nbias : 1\nvth : 1", threshold="v > vth", reset="v = 0"
    )
    group.bias, group.vth = traffic.bias, traffic.vth
    # input that arrives at the end of a step is added in the next one
    group.run_regularly("v = v + q + bias\nq = 0", when="groups")
    synapses = Synapses(group, group, "w : 1", on_pre="q_post += w")
    synapses.connect(i=traffic.source, j=traffic.target)
    synapses.w = traffic.weight
    spikes = SpikeMonitor(group, record=False)
    network = Network(group, synapses, spikes)
    return Running(lambda steps: network.run(steps * ms), lambda: np.array(spikes.count))


contest(f"brian2 {brian2.__version__}, Cython", build)
