"""The text of the value that a pass returned: a line per object, the same in every process."""

from collections.abc import Iterator
from functools import singledispatch

import nengo
import numpy as np
from nengo_loihi.block import LoihiBlock

from spikeport.compile.ground.refusal import ADDRESS
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.compile.loihi.blocks import FloatBlocks


@singledispatch
def dump(value: object) -> list[str]:
    """Return the lines that describe a network, nengo-loihi's blocks or an image."""
    raise TypeError(f"cannot describe a {type(value).__name__} as text")


@dump.register
def _(rewrite: Rewrite) -> list[str]:
    network, names = rewrite.network, rewrite.names
    return [
        *(f"ensemble {names[e]}: {_ensemble(e)}" for e in network.all_ensembles),
        *(f"node {names[n]}: {n.size_in} -> {n.size_out}" for n in network.all_nodes),
        *(f"connection {names[c]}: {_connection(c)}" for c in network.all_connections),
        *(f"probe {names[p]}: {p.attr} of {names[p.obj]}" for p in network.all_probes),
    ]


def _ensemble(ensemble: nengo.Ensemble) -> str:
    kind = type(ensemble.neuron_type).__name__  # its repr has the initial state of each neuron
    return f"{ensemble.n_neurons} {kind}, {ensemble.dimensions} d"


def _connection(connection: nengo.Connection) -> str:
    ends = [type(end).__name__.lower() for end in (connection.pre_obj, connection.post_obj)]
    return (
        f"{connection.size_in} of {ends[0]} -> {connection.size_out} of {ends[1]}, "
        f"{connection.synapse}"
    )


@dump.register
def _(floats: FloatBlocks) -> list[str]:
    return [_block(number, block) for number, block in enumerate(floats.blocks)]


def _block(number: int, block: LoihiBlock) -> str:
    rows = sum(len(synapse.weights) for synapse in block.synapses)
    axons = sum(synapse.n_axons for synapse in block.synapses)
    return (
        f"block {number} {ADDRESS.sub('', str(block.label))}: {block.n_neurons} compartments, "
        f"{np.unique(block.compartment.vth).size} thresholds, {axons} axons in, {rows} rows"
    )


@dump.register
def _(image: ChipImage) -> list[str]:
    return [*_cores(image), *_blocks(image), *_groups(image), *_routes(image)]


def _cores(image: ChipImage) -> Iterator[str]:
    for core in range(image.n_cores):
        blocks = np.flatnonzero(image.blocks.core == core)
        yield f"core {core}: blocks {', '.join(map(str, blocks))}"


def _blocks(image: ChipImage) -> Iterator[str]:
    for number, entry in enumerate(image.manifest.blocks):
        mine = part(image.blocks.start, number)
        thresholds = np.unique(image.compartments.vth[mine])
        yield (
            f"block {number} {entry.label}: compartments {mine.start} to {mine.stop - 1}, "
            f"thresholds {', '.join(map(str, thresholds))}"
        )


def _groups(image: ChipImage) -> Iterator[str]:
    for number, block in enumerate(image.groups.block):
        axons, rows = part(image.groups.axon_start, number), part(image.groups.row_start, number)
        sizes = np.diff(image.rows.start[rows.start : rows.stop + 1])
        yield (
            f"synapses {number} of block {block}: {axons.stop - axons.start} axons in, "
            f"{len(sizes)} rows, {sizes.sum()} weights"
        )


def _routes(image: ChipImage) -> Iterator[str]:
    ends = zip(image.routes.from_input, image.routes.source, image.routes.group, strict=True)
    for number, (of_input, source, group) in enumerate(ends):
        axon = image.out_axons.axon[part(image.routes.start, number)]
        reached = axon[axon >= 0]
        yield (
            f"route {'input' if of_input else 'block'} {source} -> synapses {group}: "
            f"{len(reached)} axons out to {np.unique(reached).size} in"
        )
