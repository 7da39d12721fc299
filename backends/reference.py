"""Float Nengo: the computation of a network before any chip rounds it.

If a compile would fuse its small ensembles, float Nengo runs the fused network, which is the same
up to rounding, and has far fewer operators.

The counts are those of a network wired neuron to neuron: every ensemble, also a fused one, is a
core of its own. A spike costs one message to each ensemble that its neuron connects to, and one
synaptic operation for each neuron there that it reaches: a neuron that encodes one of the values,
or has a weight. A convolution counts as weights to all neurons. Relays, splits and read-outs of a
chip are not counted, nor are signals that reach an ensemble through a node. Neurons whose type does
not spike, as `nengo.Sigmoid` and `nengo.LIFRate`, are updated in each step, but their outputs are
no spikes, and cost nothing.
"""

import copy

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.base import NengoObject
from nengo.ensemble import Neurons

from spikeport.backends.counter import Counter
from spikeport.backends.float_simulator import float_simulator
from spikeport.backends.sampling import recorded
from spikeport.backends.step_log import SUMS_ONLY, LogOptions
from spikeport.compile.ground.matrices import full
from spikeport.compile.ground.names import Names, base
from spikeport.compile.ground.rewrite import Built, Rewrite
from spikeport.compile.ground.scope import MATRICES, full_weights, target_rows
from spikeport.compile.image.fanout import Fanout
from spikeport.compile.loihi.solver import FLOAT, ParameterSolver
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
        sim = float_simulator(rewrite, dt_s, seed, optimize=False)
        ensembles = [
            e for e in network.all_ensembles if not isinstance(e.neuron_type, nengo.Direct)
        ]
        self._spikes = _Spikes([e.neuron_type for e in ensembles], dt_s)
        self._labels = tuple(rewrite.names[e] for e in ensembles)
        self._cores = np.repeat(np.arange(len(ensembles)), [e.n_neurons for e in ensembles])
        self._costs = direct_fanout(rewrite, ensembles, dt_s)
        self._ensembles = ensembles
        self._begin(sim, log)

    def _begin(self, sim: nengo.Simulator, log: LogOptions) -> None:
        self._sim = sim
        self._counter = Counter(self._labels, sim.dt, self._cores, self._costs, log)
        self._outputs = [sim.model.sig[e.neurons]["out"] for e in self._ensembles]
        self._arriving = np.zeros(len(self._cores), dtype=np.int64)

    def again(self, seed: int, log: LogOptions) -> "Reference":
        """Return the network as it was built, at rest, whatever has changed in it since."""
        other, model = copy.copy(self), self._sim.model
        other._begin(
            float_simulator(self._rewrite, model.dt, seed, optimize=False, model=model), log
        )
        return other

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


def direct_fanout(rewrite: Rewrite, ensembles: list[nengo.Ensemble], dt_s: float) -> Fanout:
    """Return the fan-out of every neuron if all ensembles were wired neuron to neuron."""
    first = dict(zip(ensembles, np.cumsum([0] + [e.n_neurons for e in ensembles]), strict=False))
    n_sources = sum(e.n_neurons for e in ensembles)
    operations = np.zeros((n_sources, len(ensembles)), dtype=np.int32)
    number = {ensemble: i for i, ensemble in enumerate(ensembles)}
    solver = ParameterSolver(rewrite, dt_s, FLOAT)
    for connection in rewrite.network.all_connections:
        pre, post = base(connection.pre_obj), base(connection.post_obj)
        if pre in number and post in number:
            neurons = np.arange(pre.n_neurons) + first[pre]
            if isinstance(connection.pre_obj, Neurons):
                neurons = neurons[connection.pre_slice]
            np.add.at(operations, (neurons, number[post]), _reached(connection, solver))
    return Fanout(operations, (operations > 0).astype(np.int32))


def _reached(connection: nengo.Connection, solver: ParameterSolver) -> np.ndarray | int:
    """Return how many neurons a spike of each neuron reaches, (n,), or of any of them.

    The neurons of a fused ensemble have encoders for the dimensions of their own member alone.
    """
    from_neurons = isinstance(connection.pre_obj, Neurons)
    post, rows = connection.post_obj, target_rows(connection)
    to_all = not isinstance(post, Neurons) and not isinstance(post.encoders, np.ndarray)
    if to_all or full_weights(connection) or not isinstance(connection.transform, MATRICES):
        return int(base(post).n_neurons)
    transform = solver.transform(connection)
    # Between thousands of neurons, a matrix with its zeros might not fit into memory.
    whole = transform if sparse.issparse(transform) else full(transform, connection.size_mid)
    weighs = sparse.csr_array(whole, copy=True) != 0  # SciPy sorts its operand in place
    if not from_neurons:  # a spike of a neuron that is decoded carries some of each value
        weighs = sparse.csr_array(weighs.sum(axis=1)[:, np.newaxis] > 0)
    if isinstance(post, Neurons):
        return np.asarray(weighs.sum(axis=0))
    encodes, sizes = np.unique(post.encoders[:, rows] != 0, axis=0, return_counts=True)
    return np.asarray(sizes @ (encodes.astype(float) @ weighs > 0))
