"""A network on NEST, at a resolution of 1 ms."""

import nest
import numpy as np
from traffic import Running, Traffic, contest

NO_LEAK_MS = 1e12


def build(traffic: Traffic) -> Running:
    """Build the network."""
    nest.set_verbosity("M_ERROR")
    nest.resolution = 1.0
    group = nest.Create("iaf_psc_delta", traffic.n, {"C_m": 1.0, "tau_m": NO_LEAK_MS, "t_ref": 0.0})
    group.E_L, group.V_th = 0.0, (traffic.vth + 0.5).tolist()  # it spikes where V reaches V_th
    group.set({"V_reset": 0.0, "V_m": 0.0})
    group.I_e = traffic.bias.astype(float).tolist()
    n, first = len(traffic.weight), group.tolist()[0]
    each = {"weight": traffic.weight.astype(float), "delay": np.ones(n)}
    nest.Connect(first + traffic.source, first + traffic.target, "one_to_one", each)
    recorder = nest.Create("spike_recorder")
    nest.Connect(group, recorder)
    nest.Prepare()

    def spikes() -> np.ndarray:
        return np.bincount(recorder.events["senders"] - first, minlength=traffic.n)

    return Running(lambda steps: nest.Run(float(steps)), spikes)


contest(f"NEST {nest.__version__}", build)
