"""The part of a network that is meant for the chip, and what of it nengo-loihi can build."""

from collections.abc import Iterator

import nengo
from nengo.base import NengoObject
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo_loihi.neurons import LoihiLIF, LoihiSpikingRectifiedLinear

from spikeport.compile.ground.names import End, Names, base

NEURON_TYPES = (nengo.LIF, nengo.SpikingRectifiedLinear, LoihiLIF, LoihiSpikingRectifiedLinear)
REGULAR_BASES = (nengo.LIFRate, nengo.RectifiedLinear)
PROBEABLE = {
    nengo.Ensemble: ("decoded_output",),
    Neurons: ("output", "spikes", "voltage", "input"),
}


class Scope:
    """A network, the names of its objects, and which of them go onto the chip."""

    def __init__(self, network: nengo.Network, names: Names) -> None:
        self.network = network
        self.names = names
        config = network.config[nengo.Ensemble]
        self._switchable = "on_chip" in config._extra_params
        self._ends_of_learning = set(_ends_of_learning(network))

    def on_chip(self, obj: End) -> bool:
        """Return whether an object's ensemble is meant for the chip."""
        ensemble = base(obj)
        return isinstance(ensemble, nengo.Ensemble) and not self.off_chip(ensemble)

    def off_chip(self, ensemble: nengo.Ensemble) -> str:
        """Return the reason why an ensemble stays on the host; an empty text if it does not."""
        if ensemble in self._ends_of_learning:
            return "kept on the host by nengo-loihi, as a target or error source of learning"
        if isinstance(ensemble.neuron_type, nengo.Direct):
            return "of neuron type Direct"
        if self._switchable and self.network.config[ensemble].on_chip is False:
            return "with on_chip = False"
        return ""

    @property
    def ensembles(self) -> list[nengo.Ensemble]:
        """The ensembles meant for the chip."""
        return [e for e in self.network.all_ensembles if self.on_chip(e)]


def _ends_of_learning(network: nengo.Network) -> Iterator[NengoObject]:
    """Yield the ends of learning: its targets and error sources, which stay on the host."""
    for connection in network.all_connections:
        if connection.learning_rule_type is not None:
            yield base(connection.post_obj)
        if isinstance(connection.post_obj, LearningRule):
            yield base(connection.pre_obj)
