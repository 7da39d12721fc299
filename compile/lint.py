"""Rules a network must keep before nengo-loihi's builder is asked: all breaches at once, in words.

nengo-loihi finds some of these one at a time, some as an assertion without text, and lets others
pass in silence (a subclass of LIF is built as plain LIF). Found by reading nengo-loihi 1.1.0's
builder and confirmed by the tests of this module.
"""

from collections.abc import Callable, Iterator
from typing import Any

import nengo
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo_loihi.inputs import ChipProcess
from nengo_loihi.neurons import LoihiLIF, LoihiSpikingRectifiedLinear

from spikeport.compile.names import Names, base
from spikeport.compile.violation import Violation

NEURON_TYPES = (nengo.LIF, nengo.SpikingRectifiedLinear, LoihiLIF, LoihiSpikingRectifiedLinear)
REGULAR_BASES = (nengo.LIFRate, nengo.RectifiedLinear)
PROBEABLE = {
    nengo.Ensemble: ("decoded_output",),
    Neurons: ("output", "spikes", "voltage", "input"),
}
OFF_CHIP_CURE = "or keep it on the host with net.config[ensemble].on_chip = False"


class Scope:
    """A network, the names of its objects, and which of them go onto the chip."""

    def __init__(self, network: nengo.Network, names: Names) -> None:
        self.network = network
        self.names = names
        config = network.config[nengo.Ensemble]
        self._switchable = "on_chip" in config._extra_params
        self._ends_of_learning = set(_ends_of_learning(network))

    def on_chip(self, obj: Any) -> bool:
        """Whether an object's ensemble is meant for the chip."""
        ensemble = base(obj)
        if not isinstance(ensemble, nengo.Ensemble) or ensemble in self._ends_of_learning:
            return False
        if isinstance(ensemble.neuron_type, nengo.Direct):
            return False
        return not (self._switchable and self.network.config[ensemble].on_chip is False)

    @property
    def ensembles(self) -> list[nengo.Ensemble]:
        """The ensembles meant for the chip."""
        return [e for e in self.network.all_ensembles if self.on_chip(e)]


def _ends_of_learning(network: nengo.Network) -> Iterator[Any]:
    """What nengo-loihi keeps on the host unasked: targets of learning, and sources of its error."""
    for connection in network.all_connections:
        if connection.learning_rule_type is not None:
            yield base(connection.post_obj)
        if isinstance(connection.post_obj, LearningRule):
            yield base(connection.pre_obj)


def lint(network: nengo.Network, names: Names) -> list[Violation]:
    """Every breach of every rule, in the order of `RULES`."""
    scope = Scope(network, names)
    return [violation for rule in RULES for violation in rule(scope)]


def some_ensemble(scope: Scope) -> Iterator[Violation]:
    """At least one ensemble is on the chip."""
    if not scope.ensembles:
        yield Violation(
            scope.names[scope.network],
            "on-chip ensembles",
            "0",
            "at least 1",
            "add an ensemble of spiking neurons that is not marked on_chip = False",
        )


def neuron_type(scope: Scope) -> Iterator[Violation]:
    """The chip has LIF and integrate-and-fire neurons, and not what a subclass adds to them."""
    for ensemble in scope.ensembles:
        kind = ensemble.neuron_type
        regular = type(kind) is nengo.RegularSpiking and type(kind.base_type) in REGULAR_BASES
        if regular or type(kind) in NEURON_TYPES:
            continue
        yield Violation(
            scope.names[ensemble],
            "neuron type",
            type(kind).__name__,
            "LIF, SpikingRectifiedLinear or RegularSpiking of LIFRate or RectifiedLinear",
            f"choose one of these, {OFF_CHIP_CURE}",
        )


def ensemble_noise(scope: Scope) -> Iterator[Violation]:
    """nengo-loihi does not map ``Ensemble.noise``."""
    for ensemble in scope.ensembles:
        if ensemble.noise is not None:
            yield Violation(
                scope.names[ensemble],
                "ensemble noise",
                type(ensemble.noise).__name__,
                "none",
                f"remove the noise, {OFF_CHIP_CURE}",
            )


def gain_and_bias(scope: Scope) -> Iterator[Violation]:
    """Gain and bias come together or not at all."""
    for ensemble in scope.ensembles:
        if (ensemble.gain is None) != (ensemble.bias is None):
            given = "bias" if ensemble.gain is None else "gain"
            yield Violation(
                scope.names[ensemble],
                "gain and bias",
                f"{given} only",
                "both or neither",
                "set both, or set max_rates and intercepts instead",
            )


def synapse(scope: Scope) -> Iterator[Violation]:
    """Between compartments the chip has one first-order low-pass filter."""
    for connection in scope.network.all_connections:
        filtered_on_chip = scope.on_chip(connection.post_obj) and (
            scope.on_chip(connection.pre_obj) or isinstance(connection.pre_obj, Neurons)
        )
        if not filtered_on_chip or connection.synapse is None:
            continue
        if type(connection.synapse) is not nengo.Lowpass:
            yield Violation(
                scope.names[connection],
                "synapse",
                type(connection.synapse).__name__,
                "Lowpass or None",
                "use nengo.Lowpass(tau) with the same group delay",
            )


def post_slice(scope: Scope) -> Iterator[Violation]:
    """nengo-loihi connects to all dimensions (or all neurons) of an ensemble on the chip."""
    for connection in scope.network.all_connections:
        part = connection.post_slice
        whole = isinstance(part, slice) and part == slice(None)
        whole = whole or not scope.on_chip(connection.post_obj)
        full_weights = isinstance(connection.pre_obj, nengo.Ensemble) and connection.solver.weights
        if not whole and not full_weights:
            yield Violation(
                scope.names[connection],
                "slice of an on-chip target",
                f"{connection.size_out} of {connection.post_obj.size_in} dimensions",
                "all",
                "connect to the whole target with a dense transform that has zero rows",
            )


def learning_rule(scope: Scope) -> Iterator[Violation]:
    """PES, from an ensemble on the chip to a node or ensemble on the host."""
    for connection in scope.network.all_connections:
        learned = base(connection.post_obj)
        if isinstance(learned, nengo.Connection) and not scope.on_chip(learned.pre_obj):
            yield Violation(
                scope.names[learned],
                "place of learning",
                "the host",
                "from an ensemble on the chip",
                "put the ensemble it comes from on the chip",
            )
        rule = connection.learning_rule_type
        if rule is None or not scope.on_chip(connection.pre_obj):
            continue
        rules = rule.values() if isinstance(rule, dict) else rule
        for one in rules if isinstance(rule, list | dict) else [rule]:
            if type(one) is not nengo.PES:
                yield Violation(
                    scope.names[connection],
                    "learning rule",
                    type(one).__name__,
                    "PES",
                    "learn with PES, or off the chip",
                )


def chip_process(scope: Scope) -> Iterator[Violation]:
    """Nodes that would run on the board are not part of an image."""
    for node in scope.network.all_nodes:
        if isinstance(node.output, ChipProcess):
            yield Violation(
                scope.names[node],
                "node on the chip",
                type(node.output).__name__,
                "none",
                "feed the events from a node on the host",
            )


def probe(scope: Scope) -> Iterator[Violation]:
    """What of the chip's state can be recorded."""
    for recorded in scope.network.all_probes:
        connection = isinstance(recorded.obj, nengo.Connection)
        if not scope.on_chip(recorded.obj.pre_obj if connection else recorded.obj):
            continue
        allowed = PROBEABLE.get(type(recorded.obj), ())
        if recorded.attr not in allowed:
            yield Violation(
                scope.names[recorded],
                "probed attribute",
                recorded.attr,
                " or ".join(allowed) or "none",
                f"probe one of these, {OFF_CHIP_CURE}",
            )


RULES: tuple[Callable[[Scope], Iterator[Violation]], ...] = (
    some_ensemble,
    neuron_type,
    ensemble_noise,
    gain_and_bias,
    synapse,
    post_slice,
    learning_rule,
    chip_process,
    probe,
)
