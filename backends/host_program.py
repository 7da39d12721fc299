"""The part of a compiled network that stays on the host."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import nengo

from spikeport.compile.pipeline import Compilation

if TYPE_CHECKING:
    from nengo_loihi.block import Synapse
    from nengo_loihi.builder import Model
    from nengo_loihi.builder.inputs import PESModulatoryTarget

    from spikeport.compile.loihi.events import EventSteps


class HostPort(NamedTuple):
    """A process that sends ``size`` values to the chip: to an input or to a learning group.

    ``target`` is the number of the input or group. Inputs are numbered through the image, including
    inputs that read a file, which have no process here. Learning groups are numbered among
    themselves: passes keep their order, but not the order of all groups.
    """

    process: nengo.Process
    size: int
    target: int


@dataclass(frozen=True)
class HostProgram:
    """The part of a compiled network that stays on the host.

    Attributes
    ----------
    model : nengo.builder.Model
        Nengo's built model.
    senders, error_senders : tuple of HostPort
        The processes that collect the spikes of each input, and the errors of groups that learn.
    receivers : tuple of (int, nengo.Process)
        The number of an output, and the process that takes its values.
    probes : dict of nengo.Probe to int
        The output that each probe of an object on the chip records.
    events : mapping of int to EventSteps
        The spikes of inputs that are read from files, by the input's number.
    """

    model: nengo.builder.Model
    senders: tuple[HostPort, ...]
    error_senders: tuple[HostPort, ...]
    receivers: tuple[tuple[int, nengo.Process], ...]
    probes: dict[nengo.Probe, int]
    events: Mapping[int, "EventSteps"] = field(default_factory=dict)


def host_program(compilation: Compilation) -> HostProgram:
    """Collect the host side of a network that nengo-loihi has built."""
    model = compilation.model
    outputs = {id(probe): i for i, probe in enumerate(model.probes)}
    node_of = {id(model.spike_targets[r]): s for s, r in model.host2chip_senders.items()}
    synapses = [s for block in model.blocks for s in block.synapses if s.learning]
    groups = {s: i for i, s in enumerate(synapses)}
    on_chip = [p for p in model.nengo_probes if p not in model.chip2host_params]
    return HostProgram(
        model=model.host,
        senders=tuple(
            HostPort(node_of[id(source)].output, source.n_neurons, i)
            for i, source in enumerate(model.inputs)
            if id(source) in node_of
        ),
        error_senders=tuple(
            HostPort(node.output, node.size_in, groups[_learning_synapse(model, target)])
            for node, target in model.host2chip_pes_senders.items()
        ),
        receivers=tuple(
            (outputs[id(model.objs[probe]["out"])], node.output)
            for probe, node in model.chip2host_receivers.items()
        ),
        probes={probe: outputs[id(model.objs[probe]["out"])] for probe in on_chip},
        events=compilation.blocks.floats.events,
    )


def _learning_synapse(model: "Model", target: "PESModulatoryTarget") -> "Synapse":
    connection = model.nengo_probe_conns[target.error_target]
    return model.objs[connection]["decoders"]
