"""A folded graph as a network: populations on the chip, their inputs and read-outs on the host.

Every connection to the chip takes one step, so that a population at depth d is d steps late; the
sources of its biases wait until its first input can arrive. Spikes are 1/dt high, as in Nengo.
"""

import math
from collections.abc import Iterator

import nengo
import numpy as np
from nengo.transforms import Dense, Sparse
from scipy import sparse

from spikeport.counted import counted
from spikeport.networks.loading.nir.populations import CONSTANTS, Population, PopulationGraph
from spikeport.networks.loading.nir.signals import Signal
from spikeport.networks.loading.nir.units import Units, all_parts, parts, units
from spikeport.neurons import IntegrateAndFire, LeakyIntegrator, SpikeSource

SMALLER = "in the graph, give the node fewer neurons, or fewer sources with weights other than zero"
ONE_PART = (
    "compile with --set parts=1, one synapse for each weight in place of two: half the axons and "
    f"synapses, and less agreement (docs/nir.md); or, {SMALLER}"
)
DENSE_FROM = 0.5
"""Share of nonzero weights above which a matrix is stored as a dense one."""
HALVED = ("SP101", "SP102", "SP104", "SP201")
"""The rules on what a second synapse of each weight doubles: axons, synapses, and so cores."""
WHOLE = 2**20
"""The most weights, with zeros, of a dense matrix that reads spikes on the host."""


class Feed:
    """The function of an input's node: it passes its input on, or plays rows."""

    def __init__(self) -> None:
        self._rows: np.ndarray | None = None
        self._dt_s = 0.0

    def play(self, rows: np.ndarray, dt_s: float) -> None:
        """Play the rows, (n_steps, size), one in each step of dt_s; then zeros."""
        self._rows, self._dt_s = rows, dt_s

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return the values of a step."""
        if self._rows is None:
            return x
        step = round(t / self._dt_s) - 1
        row: np.ndarray = self._rows[step] if 0 <= step < len(self._rows) else 0 * x
        return row


class NirNetwork(nengo.Network):
    """The network of a NIR graph.

    Parameters
    ----------
    folded : PopulationGraph
        The graph.
    n_parts : int
        Synapses of a weight: 1, or 2, where the second holds the bits beyond the first 8.
    at_once : float
        The largest share of a neuron's sources that spike in one step.
    label : str
        The name of the network.

    Attributes
    ----------
    inputs : dict of str to nengo.Node
        A node for each input: connect a signal to it that is above 0.5 in steps with a spike.
    populations : dict of str to nengo.Ensemble
        The neurons of each node.
    outputs : dict of str to nengo.Node
        The signals that are read: spikes 1/dt high, times the weights on their path, or voltages.
    feeds : dict of str to Feed
        The functions of the inputs' nodes.
    cures : dict of str to str
        Cures by the id of a rule, in place of the rule's, which speak of ensembles.
    """

    def __init__(self, folded: PopulationGraph, n_parts: int, at_once: float, label: str) -> None:
        super().__init__(label=label, seed=0)
        self.folded, self.n_parts, self.at_once = folded, n_parts, at_once
        self.cures = dict.fromkeys(HALVED, ONE_PART if n_parts > 1 else SMALLER)
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
            self._sources: dict[tuple[str, int], nengo.Ensemble] = {}
            self.populations = {
                name: self._neurons(one) if one.spikes else self._readout(one)
                for name, one in folded.populations.items()
            }
            for name, one in folded.populations.items():
                self._connect(name, one)
            self.outputs = {name: self._output(name, one) for name, one in folded.outputs.items()}

    def _source(self, name: str, late: int) -> nengo.Ensemble:
        """Return neurons on the host that spike ``late`` steps after an input is above one half."""
        if (name, late) not in self._sources:
            node = self.inputs[name]
            label = f"{name} spikes" + (f", {counted(late, 'step')} late" if late else "")
            source = _ensemble(node.size_in, SpikeSource(late), label)
            nengo.Connection(node, source.neurons, synapse=None)
            self._sources[name, late] = source
        return self._sources[name, late]

    def _constants(
        self, name: str, values: np.ndarray, wait: int
    ) -> Iterator[tuple[nengo.Ensemble, sparse.csr_matrix]]:
        """Yield a neuron on the host for each constant of a population, and its weights, (n, 1)."""
        for (label, first, n_steps), weights in zip(CONSTANTS, values, strict=True):
            if weights.any():
                kind = SpikeSource(wait=wait + first, n_steps=n_steps)
                source = _ensemble(1, kind, f"{name} {label}", bias=1)
                yield source, sparse.csr_matrix(weights[:, np.newaxis])

    def _neurons(self, population: Population) -> nengo.Ensemble:
        of, mine = population.dynamics, self.units[population.node.name]
        kind = IntegrateAndFire(
            threshold=_one_if_equal(mine.threshold),
            current_decay=_one_if_equal(of.current_decay),
            voltage_decay=_one_if_equal(of.voltage_decay),
            correction=_one_if_equal(mine.correction),
        )
        return _ensemble(population.size, kind, population.node.name)

    def _readout(self, population: Population) -> nengo.Ensemble:
        of = population.dynamics
        kind = LeakyIntegrator(of.current_decay, of.voltage_decay)
        return _ensemble(population.size, kind, population.node.name)

    def _connect(self, name: str, population: Population) -> None:
        late = self.folded.held_steps(population)
        if not population.spikes:
            self._connect_readout(name, population, late)
            return
        mine: Units = self.units[name]
        for source, part in all_parts(mine.weights, self.n_parts):
            self._to_chip(self._spikes_of(source, late), name, part)
        for constant, weights in self._constants(name, mine.constants, population.depth - 1):
            for part in parts(weights, self.n_parts):
                self._to_chip(constant, name, part)

    def _connect_readout(self, name: str, population: Population, late: int) -> None:
        target = self.populations[name].neurons
        for source, matrix in population.input.parts.items():
            weights = sparse.diags_array(population.dynamics.gain) @ matrix
            _to_host(self._spikes_of(source, late), target, weights)
        for constant, weights in self._constants(name, population.constants(), population.depth):
            _to_host(constant, target, weights)

    def _to_chip(self, source: nengo.Ensemble, name: str, part: sparse.csr_matrix) -> None:
        target = self.populations[name].neurons
        # A filter without a time constant takes the one step that the chip takes.
        nengo.Connection(
            source.neurons, target, transform=_transform(part), synapse=nengo.Lowpass(0)
        )

    def _output(self, name: str, signal: Signal) -> nengo.Node:
        """Make a node that reads a signal; it has a function, so that the chip sends to it."""
        n = math.prod(signal.shape)
        node = nengo.Node(_unchanged, size_in=n, size_out=n, label=name)
        for source, matrix in signal.parts.items():
            _to_host(self._spikes_of(source, late=0), node, matrix)
        if signal.constant.any():
            self._add_constant(name, node, signal)
        return node

    def _add_constant(self, name: str, node: nengo.Node, signal: Signal) -> None:
        """Add a signal's constant in the signal's unit: to spikes, as a spike in every step."""
        if any(one in self.inputs or self.folded.populations[one].spikes for one in signal.parts):
            source = _ensemble(1, SpikeSource(), f"{name} constant", bias=1)
            _to_host(source, node, sparse.csr_matrix(signal.constant[:, np.newaxis]))
        else:
            constant = nengo.Node(signal.constant, label=f"{name} constant")
            nengo.Connection(constant, node, synapse=None)

    def _spikes_of(self, source: str, late: int) -> nengo.Ensemble:
        """Return the neurons of a population, or those that send an input ``late`` steps later."""
        return self._source(source, late) if source in self.inputs else self.populations[source]


def _unchanged(t: float, x: np.ndarray) -> np.ndarray:
    return x


def _to_host(
    source: nengo.Ensemble, target: nengo.base.NengoObject, matrix: sparse.csr_matrix
) -> None:
    """Connect neurons to an object on the host; the chip sends by dense matrices, or unweighted."""
    n_rows, n_columns = matrix.shape
    if n_rows == n_columns and (matrix != sparse.eye_array(n_rows)).nnz == 0:
        nengo.Connection(source.neurons, target, synapse=None)
    elif n_rows * n_columns <= WHOLE:
        weights = Dense(matrix.shape, init=matrix.toarray())
        nengo.Connection(source.neurons, target, transform=weights, synapse=None)
    else:
        spikes = nengo.Node(size_in=n_columns, label=f"{source.label} unweighted")
        nengo.Connection(source.neurons, spikes, synapse=None)
        nengo.Connection(spikes, target, transform=_transform(matrix), synapse=None)


def _ensemble(
    n: int, kind: nengo.neurons.NeuronType, label: str, bias: float = 0
) -> nengo.Ensemble:
    """Return neurons whose input is their current."""
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
    return Sparse(matrix.shape, init=sparse.csr_matrix(matrix))
