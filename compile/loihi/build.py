"""The build of a network into float blocks, by nengo-loihi's builder.

The builder is used as it is, since it defines the arithmetic; `OrderedModel` makes it reproducible.
"""

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import nengo
import numpy as np
from nengo.ensemble import Neurons
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder import Model
from nengo_loihi.inputs import LoihiInput
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.check.finite import refused_or_not_finite
from spikeport.compile.ground.filters import Passage, time_constant_s
from spikeport.compile.ground.names import Names, base
from spikeport.compile.ground.refusal import RefusedError, concerning
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import neurons_read
from spikeport.compile.image.manifest import BlockEntry, Encoding, Filter, InputEntry
from spikeport.compile.loihi.blocks import FloatBlocks, OutputName, first_of
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.compile.loihi.error_parts import error_parts_placed
from spikeport.compile.loihi.host_neurons import SparseInputNeurons
from spikeport.compile.loihi.host_probes import connections_probed_on_host
from spikeport.compile.loihi.host_types import host_types_stay
from spikeport.compile.loihi.known_sizes import sizes_known
from spikeport.compile.loihi.merged_connections import merged_in_full
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.ordered_model import OrderedModel
from spikeport.compile.loihi.quick_builder import quick_builder
from spikeport.compile.loihi.shared_solves import shared_solves
from spikeport.compile.loihi.split_synapses import split_by_tables
from spikeport.compile.loihi.staying_nodes import nodes_stay
from spikeport.errors import UsageError


def build(rewrite: Rewrite, dt_s: float, settings: BuildSettings = AS_USUAL) -> FloatBlocks:
    """Build a network.

    Parameters
    ----------
    rewrite : Rewrite
        The network, after its passes. If it has no seed, 0 is used.
    dt_s : float
        The time step, in seconds.
    settings : BuildSettings
        nengo-loihi's settings of the build.

    Raises
    ------
    RefusedError
        If nengo-loihi's builder refuses the network for a reason that `lint` does not know.
    """
    model, names = _built(rewrite, dt_s, settings), rewrite.names
    floats = FloatBlocks(
        model=model,
        blocks=tuple(model.blocks),
        entries=tuple(_entries(model, rewrite)),
        inputs=tuple(_input_entry(model, source) for source in model.inputs),
        outputs=tuple(_output_name(model, probe) for probe in model.probes),
        events={
            number: model.events[i] for number, i in enumerate(model.inputs) if i in model.events
        },
        passages=tuple(_passages(model)),
        ends={
            names[obj]: names.with_ends(obj)
            for obj in model.objs
            if isinstance(obj, nengo.Connection)
        },
    )
    _check_order_of_reads(model, names)
    _check_population_axons(floats)
    return floats


def _built(rewrite: Rewrite, dt_s: float, settings: BuildSettings) -> OrderedModel:
    """Return nengo-loihi's model of a network, in floating point."""
    network = rewrite.network
    model = OrderedModel(rewrite, dt_s)
    # Objects keep their seeds of the user's network, so that they draw the same random numbers.
    model.seeds.update({network: network.seed or 0, **rewrite.seeds})
    model.seeded[network] = True
    settings.set_on(model)
    if rewrite.input_weight is not None:
        model.node_neurons = SparseInputNeurons(dt_s, rewrite.input_weight)
    with (
        _without_filter_warnings(),
        numpy1_semantics(),
        quick_builder(),
        connections_probed_on_host(),
        host_types_stay(),
        sizes_known(network),
        nodes_stay(),
        error_parts_placed(),
        merged_in_full(model.failed_at),
        shared_solves(),
        split_by_tables(),
    ):
        try:
            model.build(
                network,
                precompute=False,
                remove_passthrough=settings.remove_passthrough,
                discretize=False,
            )
        except UsageError:  # an event file could not be read
            raise
        except Exception as error:  # the builder refuses by errors of any kind, not only its own
            raise refused_or_not_finite(model.building, error) from error
    return model


@contextlib.contextmanager
def _without_filter_warnings() -> Iterator[None]:
    """Ignore nengo-loihi's warnings of filters that share compartments: rule SP409 reports them."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="tau_s is (already|currently)")
        yield


def _refusal(name: str, why: str) -> RefusedError:
    return concerning((name,), RefusedError(f"{name}: {why}"))


def _check_order_of_reads(model: Model, names: Names) -> None:
    """Refuse probes that read a split ensemble out of order: nengo-loihi mixes up the neurons."""
    for probe in model.nengo_probes:
        if not isinstance(probe.obj, Neurons):
            continue
        blocks = len(model.objs[probe]["out"].target)
        if blocks > 1 and np.any(np.diff(neurons_read(probe)) <= 0):
            raise _refusal(
                names[probe.obj],
                "a probe reads its neurons out of order, which fails because they are split over "
                "several cores; cure: probe them in ascending order",
            )


def _check_population_axons(floats: FloatBlocks) -> None:
    """Refuse axons of population type 16 that do not address every fourth compartment."""
    for entry, block in zip(floats.entries, floats.blocks, strict=True):
        for synapse in block.synapses:
            bases = np.asarray(synapse.axon_compartment_bases)
            if synapse.pop_type == 16 and np.any(bases[bases >= 0] % 4):
                refusal = RefusedError(
                    f"{entry.label}: axons of population type 16 start at compartments that are "
                    "not multiples of 4; cure: use pop_type 32, or channels_last=True with a "
                    "multiple of 4 filters, also in each block"
                )
                raise concerning((entry.label, *floats.about(entry.owner)), refusal)


def _entries(model: OrderedModel, rewrite: Rewrite) -> Iterator[BlockEntry]:
    """Yield the entry of each block of a model."""
    found: dict[LoihiBlock, BlockEntry] = {}
    for obj, parts in model.objs.items():
        if isinstance(obj, nengo.Ensemble):
            found.update(_pieces(parts["out"], _ensemble_entry(obj, rewrite)))
        elif isinstance(obj, nengo.Connection) and "decoded" in parts:
            kind: Literal["relay", "readout"]
            kind = "relay" if isinstance(obj.post_obj, nengo.Ensemble) else "readout"
            found.update(_pieces(parts["decoded"], BlockEntry(kind, model.names[obj])))
    return (found[block] for block in model.blocks)


def _ensemble_entry(ensemble: nengo.Ensemble, rewrite: Rewrite) -> BlockEntry:
    if piece := rewrite.pieces.get(ensemble):
        return BlockEntry("ensemble", piece.owner, ((piece.number, piece.count),))
    return BlockEntry("ensemble", rewrite.names[ensemble])


def _passages(model: OrderedModel) -> Iterator[Passage]:
    """Yield the filters of each connection that ends on the chip."""
    names = model.names
    for connection, target_s in model.target_filters_s.items():
        pre, post = base(connection.pre_obj), base(connection.post_obj)
        source = names[pre] if model.split.on_chip(pre) else ""
        relay = model.objs[connection].get("decoded") if source else None
        relay_s = None if relay is None else float(first_of(relay).compartment.tau_s)
        own_s = time_constant_s(connection)
        yield Passage(names[connection], source, names[post], own_s, relay_s, target_s)


def _pieces(
    blocks: LoihiBlock | list[LoihiBlock], entry: BlockEntry
) -> Iterator[tuple[LoihiBlock, BlockEntry]]:
    """Yield the blocks of an object; nengo-loihi splits some objects into several blocks."""
    if not isinstance(blocks, list) or len(blocks) == 1:
        yield first_of(blocks), entry
        return
    for i, block in enumerate(blocks):
        yield block, replace(entry, piece=(*entry.piece, (i, len(blocks))))


def _input_entry(model: OrderedModel, source: LoihiInput) -> InputEntry:
    crossing = model.crossings[source]
    size = int(source.n_neurons)
    name = model.names[crossing]
    if crossing not in model.connection_decode_neurons:
        return InputEntry(name, size, Encoding("spikes"))  # the chip filters spikes
    neurons = model.node_neurons
    # Every pair of host neurons has the same gain and bias: the first pair stands for all.
    encoding = Encoding("on_off", float(neurons.gain[0]), float(neurons.bias[0]))
    return InputEntry(name, size, encoding, _filter(crossing.synapse))


def _output_name(model: OrderedModel, probe: LoihiProbe) -> OutputName:
    crossing = model.crossings[probe]
    return OutputName(model.names[crossing], _filter(crossing.synapse))


def _filter(synapse: nengo.synapses.Synapse | None) -> Filter | None:
    if synapse is None:
        return None
    tau_s = getattr(synapse, "tau", None)
    return Filter(type(synapse).__name__, None if tau_s is None else float(tau_s))
