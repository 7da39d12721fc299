"""Float Nengo, as it comes: what a network computes before any chip rounds it.

The counts are those of the network wired directly: every ensemble is a core of its own, a spike
costs one message to each ensemble its neurons connect to, and one synaptic operation for each of
that ensemble's neurons. Relays, splits and read-outs of a chip are not in them, nor is what
reaches an ensemble through a node.
"""

from typing import Any

import nengo
import numpy as np
from nengo.ensemble import Neurons

from spikeport.backends.counter import Counter
from spikeport.compile.fanout import Fanout
from spikeport.compile.names import Names, base
from spikeport.hardware_models.activity import Activity


class Reference:
    """A network on `nengo.Simulator`, with its spikes counted.

    Implements `spikeport.backends.execution.Execution`.

    Parameters
    ----------
    network : nengo.Network
        The network; a seed of 0 stands in where it has none.
    dt_s : float
        The time step, in seconds.
    seed : int
        Seed of processes and noise.
    """

    compilation = None

    def __init__(self, network: nengo.Network, dt_s: float, seed: int) -> None:
        model = nengo.builder.Model(dt=dt_s)
        model.seeds[network] = network.seed if network.seed is not None else 0
        model.seeded[network] = True
        # Nengo's optimiser merges operators in an order that differs from run to run, and with it
        # the rounding of sums: without it a run depends on its seeds alone.
        self._sim = nengo.Simulator(
            network, dt=dt_s, seed=seed, model=model, progress_bar=False, optimize=False
        )
        ensembles = [
            e for e in network.all_ensembles if not isinstance(e.neuron_type, nengo.Direct)
        ]
        self._dt_s = dt_s
        names = Names(network)
        cores = np.repeat(np.arange(len(ensembles)), [e.n_neurons for e in ensembles])
        self._counter = Counter(
            tuple(names[e] for e in ensembles), cores, direct_fanout(network, ensembles)
        )
        self._outputs = [self._sim.model.sig[e.neurons]["out"] for e in ensembles]
        self._arriving = np.zeros(0, dtype=int)
        self._all_active = np.ones(len(cores), dtype=bool)

    def step(self) -> None:
        """Advance by one step."""
        self._sim.step()
        outputs = [self._sim.signals[out] for out in self._outputs]
        spiked = np.concatenate([np.zeros(0), *outputs]) != 0
        self._counter.step(self._arriving, spiked, self._all_active)
        self._arriving = np.flatnonzero(spiked)

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """(n_steps, size) what a probe recorded."""
        return np.asarray(self._sim.data[probe])

    def built(self, obj: Any) -> Any:
        """See `spikeport.backends.execution.Execution.built`."""
        return self._sim.model.params[obj]

    def clear_probes(self) -> None:
        """Forget what the probes recorded so far."""
        self._sim.clear_probes()

    def activity(self) -> Activity:
        """Exact counts so far."""
        return self._counter.activity(self._dt_s)

    def close(self) -> None:
        """Free the simulator."""
        self._sim.close()


def direct_fanout(network: nengo.Network, ensembles: list[nengo.Ensemble]) -> Fanout:
    """Fan-out of every neuron if all ensembles were wired neuron to neuron."""
    first = dict(zip(ensembles, np.cumsum([0] + [e.n_neurons for e in ensembles]), strict=False))
    n_sources = sum(e.n_neurons for e in ensembles)
    operations = np.zeros((n_sources, len(ensembles)), dtype=np.int32)
    messages = np.zeros_like(operations)
    number = {ensemble: i for i, ensemble in enumerate(ensembles)}
    for connection in network.all_connections:
        pre, post = base(connection.pre_obj), base(connection.post_obj)
        if pre not in number or post not in number:
            continue
        neurons = np.arange(pre.n_neurons) + first[pre]
        if isinstance(connection.pre_obj, Neurons):
            neurons = neurons[connection.pre_slice]
        messages[neurons, number[post]] = 1
        operations[neurons, number[post]] += post.n_neurons
    return Fanout(operations, messages)
