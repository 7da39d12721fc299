"""A folded graph as a network: populations on the chip, their inputs and read-outs on the host.

Every connection to the chip takes one step, so that a population at depth d is d steps late; the
sources of its biases wait until its first input can be there. Spikes are 1/dt high, as Nengo's.
"""

import math
import warnings

import nengo
import numpy as np
from nengo.transforms import Dense, Sparse
from scipy import sparse

from spikeport.networks.loading.nir.populations import Folded, Population, Signal
from spikeport.networks.loading.nir.units import Units, all_parts, parts, units
from spikeport.neurons import IntegrateAndFire, LeakyIntegrator, SpikeSource

DENSE_FROM = 0.5
"""Share of weights other than zero from which on a matrix is stored whole."""


class Feed:
    """The function of an input's node: what is connected to it, or rows that are played."""

    def __init__(self) -> None:
        self._rows: np.ndarray | None = None
        self._dt_s = 0.0

    def play(self, rows: np.ndarray, dt_s: float) -> None:
        """Have a row, (n_steps, size), for each of the first steps of dt_s; then nothing."""
        self._rows, self._dt_s = rows, dt_s

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return the values of a step."""
        if self._rows is None:
            return x
        step = round(t / self._dt_s) - 1
        row: np.ndarray = self._rows[step] if 0 <= step < len(self._rows) else 0 * x
        return row


class NirNetwork(nengo.Network):
    """A network of a NIR graph.

    Parameters
    ----------
    folded : Folded
        The graph.
    n_parts : int
        Synapses of a weight: 1, or 2 for one that holds the bits that 8 do not.
    at_once : float
        The largest share of a neuron's sources that spike in one step.
    label : str
        The name of the network.

    Attributes
    ----------
    inputs : dict of str to nengo.Node
        A node for each input: connect to it what is above 0.5 in steps with a spike.
    populations : dict of str to nengo.Ensemble
        The neurons of each node.
    outputs : dict of str to nengo.Node
        The signals read: spikes 1/dt high, times the weights on their way; voltages as they are.
    feeds : dict of str to Feed
        The functions of the inputs' nodes.
    """

    def __init__(self, folded: Folded, n_parts: int, at_once: float, label: str) -> None:
        super().__init__(label=label, seed=0)
        self.folded, self.n_parts, self.at_once = folded, n_parts, at_once
        with warnings.catch_warnings(action="ignore"):  # of every nengo newer than 3.2
            import nengo_loihi
        nengo_loihi.add_params(self)
        self.units = {
            name: units(one, n_parts, at_once)
            for name, one in folded.populations.items()
            if one.spikes
        }
        with self:
            self.feeds = {name: Feed() for name in folded.inputs}
            self.inputs = {
                name: nengo.Node(self.feeds[name], size_in=n, size_out=n, label=name)
                for name, n in ((name, math.prod(s)) for name, s in folded.inputs.items())
            }
            self._sources = {name: self._source(name, node) for name, node in self.inputs.items()}
            self.populations = {
                name: self._neurons(one) if one.spikes else self._readout(one)
                for name, one in folded.populations.items()
            }
            for name, one in folded.populations.items():
                self._connect(name, one)
            self.outputs = {name: self._output(name, one) for name, one in folded.outputs.items()}

    def _source(self, name: str, node: nengo.Node) -> nengo.Ensemble:
        """Make neurons on the host that spike where a node is above one half."""
        source = _ensemble(node.size_in, SpikeSource(), f"{name} spikes")
        self.config[source].on_chip = False
        nengo.Connection(node, source.neurons, synapse=None)
        return source

    def _neurons(self, population: Population) -> nengo.Ensemble:
        of, mine = population.dynamics, self.units[population.node.name]
        values = (mine.threshold, of.current_decay, of.voltage_decay, mine.leak)
        kind = IntegrateAndFire(*map(_one_if_equal, values))
        return _ensemble(population.size, kind, population.node.name)

    def _readout(self, population: Population) -> nengo.Ensemble:
        of = population.dynamics
        kind = LeakyIntegrator(of.current_decay, of.voltage_decay, of.leak)
        readout = _ensemble(population.size, kind, population.node.name)
        self.config[readout].on_chip = False
        return readout

    def _connect(self, name: str, population: Population) -> None:
        if not population.spikes:
            self._read(self.populations[name].neurons, population.input, population.dynamics.gain)
            return
        mine: Units = self.units[name]
        for source, part in all_parts(mine.weights, self.n_parts):
            self._to_chip(self._spikes_of(source), name, part)
        if mine.bias.any():
            bias = _ensemble(1, SpikeSource(wait=population.depth - 1), f"{name} bias", bias=1)
            self.config[bias].on_chip = False
            for part in parts(sparse.csr_matrix(mine.bias[:, np.newaxis]), self.n_parts):
                self._to_chip(bias, name, part)

    def _to_chip(self, source: nengo.Ensemble, name: str, part: sparse.csr_matrix) -> None:
        target = self.populations[name].neurons
        # A filter without a time constant takes the one step that the chip takes.
        nengo.Connection(
            source.neurons, target, transform=_transform(part), synapse=nengo.Lowpass(0)
        )

    def _output(self, name: str, signal: Signal) -> nengo.Node:
        node = nengo.Node(size_in=math.prod(signal.shape), label=name)
        self._read(node, signal, np.ones(node.size_in))
        return node

    def _read(self, target: nengo.base.NengoObject, signal: Signal, gain: np.ndarray) -> None:
        """Connect what is read on the host, and what is constant there."""
        for source, matrix in signal.parts.items():
            weights = Dense(matrix.shape, init=gain[:, np.newaxis] * matrix.toarray())
            nengo.Connection(
                self._spikes_of(source).neurons, target, transform=weights, synapse=None
            )
        if signal.constant.any():
            constant = nengo.Node(gain * signal.constant, label="constant")
            nengo.Connection(constant, target, synapse=None)

    def _spikes_of(self, source: str) -> nengo.Ensemble:
        return self._sources[source] if source in self._sources else self.populations[source]


def _ensemble(
    n: int, kind: nengo.neurons.NeuronType, label: str, bias: float = 0
) -> nengo.Ensemble:
    """Return neurons whose input is a current as it is."""
    return nengo.Ensemble(
        n,
        1,
        gain=np.ones(n),
        bias=np.full(n, float(bias)),
        encoders=np.ones((n, 1)),
        neuron_type=kind,
        label=label,
    )


def _one_if_equal(values: np.ndarray) -> np.ndarray | float:
    return float(values[0]) if (values == values[0]).all() else values


def _transform(matrix: sparse.csr_matrix) -> Dense | Sparse:
    if matrix.nnz > DENSE_FROM * math.prod(matrix.shape):
        return Dense(matrix.shape, init=matrix.toarray())
    return Sparse(matrix.shape, init=matrix)
