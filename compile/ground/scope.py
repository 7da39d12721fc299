"""The part of a network that is meant for the chip, and the objects that nengo-loihi can build."""

from collections.abc import Iterator

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo_loihi.inputs import ChipProcess
from nengo_loihi.neurons import LoihiLIF, LoihiSpikingRectifiedLinear

from spikeport.compile.ground.names import End, Names, base
from spikeport.neurons import HOST_TYPES

NEURON_TYPES = (nengo.LIF, nengo.SpikingRectifiedLinear, LoihiLIF, LoihiSpikingRectifiedLinear)
REGULAR_BASES = (nengo.LIFRate, nengo.RectifiedLinear)
CONVOLUTIONS = (nengo.Convolution, nengo.transforms.ConvolutionTranspose)
MATRICES = (nengo.Dense, nengo.Sparse, nengo.transforms.NoTransform)
PROBEABLE = {
    nengo.Ensemble: ("decoded_output",),
    Neurons: ("output", "voltage", "input"),
}

STATE = ("voltage", "input")
"""The attributes of neurons that are integers on the chip."""


def is_passthrough(obj: object) -> bool:
    """Return whether an object is a node that puts out its input."""
    return isinstance(obj, nengo.Node) and obj.output is None


def same(_time_s: float, values: np.ndarray) -> np.ndarray:
    """Return the values: the function of a node that no pass takes for a passthrough node."""
    return values


class Scope:
    """A network, the names of its objects, and which of them go onto the chip."""

    def __init__(self, network: nengo.Network, names: Names) -> None:
        self.network = network
        self.names = names
        config = network.config[nengo.Ensemble]
        # The setting exists only after `add_params`.
        self._switchable = "on_chip" in config._extra_params
        self._ends_of_learning = set(_ends_of_learning(network))

    def on_chip(self, obj: End) -> bool:
        """Return whether an object's ensemble, or a node with events of a file, is for the chip."""
        ensemble = base(obj)
        if isinstance(ensemble, nengo.Node):
            return isinstance(ensemble.output, ChipProcess)
        return isinstance(ensemble, nengo.Ensemble) and not self.off_chip(ensemble)

    def off_chip(self, ensemble: nengo.Ensemble) -> str:
        """Return the reason why an ensemble stays on the host; an empty text if it does not."""
        if ensemble in self._ends_of_learning:
            return "kept on the host by nengo-loihi, as a target or error source of learning"
        if isinstance(ensemble.neuron_type, (nengo.Direct, *HOST_TYPES)):
            return f"of neuron type {type(ensemble.neuron_type).__name__}"
        if self._switchable and self.network.config[ensemble].on_chip is False:
            return "with on_chip = False"
        return ""

    def in_chip_units(self, probe: nengo.Probe) -> bool:
        """Return whether a probe records integers of the chip, which float Nengo does not have."""
        return probe.attr in STATE and isinstance(probe.obj, Neurons) and self.on_chip(probe.obj)

    def reaches_part(self, connection: nengo.Connection) -> bool:
        """Return whether a connection ends in a part of an ensemble on the chip.

        Full weights between ensembles on the chip do not count: nengo-loihi solves them for the
        part by itself.
        """
        part = connection.post_slice
        if isinstance(part, slice) and part == slice(None):
            return False
        solved = full_weights(connection) and self.on_chip(connection.pre_obj)
        return self.on_chip(connection.post_obj) and not solved

    def repeats_spikes(self, connection: nengo.Connection) -> bool:
        """Return whether a connection on the chip reads a source of spikes more than once."""
        pre, post = connection.pre_obj, connection.post_obj
        if isinstance(pre, nengo.Ensemble) or not reads_twice(connection):
            return False
        return self.on_chip(pre) and self.on_chip(post)

    def from_host_neurons(self) -> Iterator[nengo.Connection]:
        """Yield the connections from neurons on the host to objects on the chip."""
        for connection in self.network.all_connections:
            from_host = isinstance(connection.pre_obj, Neurons) and not self.on_chip(
                connection.pre_obj
            )
            if from_host and self.on_chip(connection.post_obj):
                yield connection

    @property
    def ensembles(self) -> list[nengo.Ensemble]:
        """The ensembles meant for the chip."""
        # One that several networks list is built once.
        return [e for e in dict.fromkeys(self.network.all_ensembles) if self.on_chip(e)]


def full_weights(connection: nengo.Connection) -> bool:
    """Return whether a connection's solver gives weights from neuron to neuron, not decoders."""
    return isinstance(connection.pre_obj, nengo.Ensemble) and bool(connection.solver.weights)


def is_link(connection: nengo.Connection, scope: Scope) -> bool:
    """Return whether nengo-loihi would build plain decode neurons for a connection."""
    pre, post = connection.pre_obj, connection.post_obj
    return (
        scope.on_chip(pre)
        and scope.on_chip(post)
        and isinstance(post, nengo.Ensemble)
        and not full_weights(connection)
        and connection.learning_rule_type is None
        and isinstance(connection.transform, MATRICES)
    )


def is_plain(kind: nengo.neurons.NeuronType) -> bool:
    """Return whether nengo-loihi builds neurons of a type."""
    regular = type(kind) is nengo.RegularSpiking and type(kind.base_type) in REGULAR_BASES
    return regular or type(kind) in NEURON_TYPES


def height_in_rates(kind: nengo.neurons.NeuronType) -> float:
    """Return the factor in a type's rates that is the height of its spikes."""
    return 1.0 if isinstance(kind, nengo.RegularSpiking) else getattr(kind, "amplitude", 1.0)


def is_called(connection: nengo.Connection) -> bool:
    """Return whether a run calls a connection's function in each step; it may have a state then.

    Functions of ensembles, unless these are of type Direct, are only called as decoders are solved.
    """
    pre = connection.pre_obj
    runs = isinstance(pre, nengo.Node) or isinstance(
        getattr(pre, "neuron_type", None), nengo.Direct
    )
    return runs and callable(connection.function)


def probeable(obj: object) -> tuple[str, ...]:
    """Return the attributes of an object on the chip that can be probed."""
    return next((names for kind, names in PROBEABLE.items() if isinstance(obj, kind)), ())


def source_rows(connection: nengo.Connection) -> np.ndarray:
    """Return the entries of a connection's source that it reads, (n,)."""
    rows: np.ndarray = np.arange(connection.pre_obj.size_out)[connection.pre_slice]
    return rows


def reads_twice(connection: nengo.Connection) -> bool:
    """Return whether a connection's slice has an entry of its source more than once."""
    if isinstance(connection.pre_slice, slice):
        return False
    rows = source_rows(connection)
    return len(np.unique(rows)) < len(rows)


def target_rows(connection: nengo.Connection) -> np.ndarray:
    """Return the entries of a connection's target that its values go to, (size_out,)."""
    rows: np.ndarray = np.arange(connection.post_obj.size_in)[connection.post_slice]
    return rows


def neurons_read(probe: nengo.Probe) -> np.ndarray:
    """Return the numbers of the neurons that a probe of neurons reads, (n,)."""
    part = slice(None) if probe.slice is None else probe.slice
    read: np.ndarray = np.arange(probe.obj.size_out)[part]
    return read


def in_full(connection: nengo.Connection) -> bool:
    """Return whether a connection's values go to all entries of its target, in order."""
    return np.array_equal(target_rows(connection), np.arange(connection.post_obj.size_in))


def _ends_of_learning(network: nengo.Network) -> Iterator[NengoObject]:
    """Yield the ends of learning: its targets and error sources, which stay on the host."""
    for connection in network.all_connections:
        if connection.learning_rule_type is not None:
            yield base(connection.post_obj)
        if isinstance(connection.post_obj, LearningRule):
            yield base(connection.pre_obj)
