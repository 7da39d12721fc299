"""Float Nengo: the computation of a network before any chip rounds it.

If a compile would fuse its small ensembles, float Nengo runs the fused network, which is the same
up to rounding, and has far fewer operators.

The counts are those of a network wired neuron to neuron: every ensemble is a core of its own, a
spike costs one message to each ensemble that its neuron connects to, and one synaptic operation for
each of that ensemble's neurons. Relays, splits and read-outs of a chip are not counted, nor are
signals that reach an ensemble through a node. Neurons whose type does not spike, as `nengo.Sigmoid`
and `nengo.LIFRate`, are updated in each step, but their outputs are no spikes, and cost nothing.
"""

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.ensemble import Neurons

from spikeport.backends.counter import Counter
from spikeport.backends.float_simulator import float_simulator
from spikeport.backends.sampling import recorded
from spikeport.backends.step_log import SUMS_ONLY, LogOptions
from spikeport.compile.ground.names import Names, base
from spikeport.compile.ground.rewrite import Built, Rewrite
from spikeport.compile.image.fanout import Fanout
from spikeport.compile.loihi.solver import FLOAT
from spikeport.compile.passes.base import Context
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.rewriting.once import each_once
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel


class Reference:
    """A network on `nengo.Simulator`, with its spikes counted.

    Implements `spikeport.backends.execution.Execution`.

    Parameters
    ----------
    rewrite : Rewrite
        The network, and how the user's objects were replaced in it, see `fused`; a network without
        a seed gets seed 0.
    dt_s : float
        The time step, in seconds.
    seed : int
        Seed of processes and noise.
    log : LogOptions
        See `spikeport.backends.step_log.StepLog`.
    """

    compilation = None
    link = None

    def __init__(
        self, rewrite: Rewrite, dt_s: float, seed: int, log: LogOptions = SUMS_ONLY
    ) -> None:
        self._rewrite, network = rewrite, rewrite.network
        self._sim = float_simulator(rewrite, dt_s, seed, optimize=False)
        ensembles = [
            e for e in network.all_ensembles if not isinstance(e.neuron_type, nengo.Direct)
        ]
        self._spikes = _Spikes([e.neuron_type for e in ensembles], dt_s)
        names = rewrite.names
        cores = np.repeat(np.arange(len(ensembles)), [e.n_neurons for e in ensembles])
        self._counter = Counter(
            tuple(names[e] for e in ensembles), dt_s, cores, direct_fanout(network, ensembles), log
        )
        self._outputs = [self._sim.model.sig[e.neurons]["out"] for e in ensembles]
        self._arriving = np.zeros(len(cores), dtype=np.int64)

    def step(self) -> None:
        """Advance by one step."""
        self._sim.step()
        outputs = [self._sim.signals[out] for out in self._outputs]
        # To count the spikes of no neurons took a quarter of a step of an exact controller.
        spikes = self._spikes.counted(outputs) if outputs else self._arriving
        self._counter.step_of_spikes(self._arriving, spikes)
        self._arriving = spikes

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """Return the values that a probe recorded, (n_steps, size)."""
        return recorded(self._sim, self._rewrite.stand_ins.get(probe, probe))

    def built(self, obj: NengoObject) -> Built:
        """Return the built parameters; see `spikeport.backends.execution.Execution.built`."""
        built = self._rewrite.built
        return built[obj] if obj in built else self._sim.model.params[obj]

    def clear_probes(self) -> None:
        """Forget the values that probes recorded so far."""
        self._sim.clear_probes()

    def activity(self) -> Activity:
        """Return exact counts so far."""
        return self._counter.activity()

    def close(self) -> None:
        """Free the simulator."""
        self._counter.close()
        self._sim.close()


MOST_SPIKES = 10**6
"""A neuron counts as that many spikes in a step at most. Outputs of networks that diverge have no
bound, and sums of them would not fit into an integer."""


class _Spikes:
    """The spikes in the outputs of ensembles, whose neurons may spike several times in a step.

    spikes = |output| dt / amplitude        0 for types that do not spike
    """

    def __init__(self, kinds: list[nengo.neurons.NeuronType], dt_s: float) -> None:
        # Some types, as Izhikevich, have no amplitude: each of their spikes is 1 / dt.
        amplitudes = [getattr(kind, "amplitude", 1.0) for kind in kinds]
        self._per_output = [
            dt_s / amplitude if kind.spiking else 0.0
            for kind, amplitude in zip(kinds, amplitudes, strict=True)
        ]

    def counted(self, outputs: list[np.ndarray]) -> np.ndarray:
        """Return how often each neuron spikes, (n,)."""
        spikes = [abs(one) * by for one, by in zip(outputs, self._per_output, strict=True)]
        counts = np.nan_to_num(np.concatenate(spikes))
        whole: np.ndarray = np.rint(np.minimum(counts, MOST_SPIKES)).astype(np.int64)
        return whole


def fused(network: nengo.Network, chip: ChipModel, dt_s: float, pipeline: Pipeline) -> Rewrite:
    """Return a network as float Nengo runs it: rewritten by `Fuse`, if the pipeline has it."""
    # A network may list an object twice: it is built, and counted, once.
    rewrite = each_once(Rewrite(network, Names(network)))
    context = Context(chip, dt_s, note=lambda _key, _value: None)
    for one in pipeline.passes:
        if isinstance(one, Fuse):
            # Float neurons fire at other rates than the chip's: Nengo's decoders are right here.
            rewrite = one.apply(rewrite, context, FLOAT)
    return rewrite


def direct_fanout(network: nengo.Network, ensembles: list[nengo.Ensemble]) -> Fanout:
    """Return the fan-out of every neuron if all ensembles were wired neuron to neuron."""
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
