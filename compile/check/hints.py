"""Hints on what compiles, but is lost or left out: rules SP4xx, of a network and its image."""

from collections.abc import Iterator, Sequence

import nengo
import numpy as np

from spikeport.compile.check import rules
from spikeport.compile.check.drive import duplicated, silenced
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part

LOST = 0.1
"""Share of a block's weights above which their loss is worth a hint."""
DUPLICATED = 0.1
"""Share of a block's neurons above which copies are worth a hint: a few come about by rounding."""


def network_hints(network: nengo.Network, names: Names) -> Iterator[Violation]:
    """Yield a hint for each passthrough node that nengo-loihi removes with all that leads to it.

    Ensemble arrays are left out: they have an output for every function, used or not.
    """
    read = {c.pre_obj for c in network.all_connections} | {p.obj for p in network.all_probes}
    fed = {c.post_obj for c in network.all_connections}
    for node in network.all_nodes:
        if node.output is None and node in fed - read - set(_nodes_of_arrays(network)):
            yield rules.get("SP401").broken(names[node], "leads nowhere and is not probed")


def _nodes_of_arrays(network: nengo.Network) -> Iterator[nengo.Node]:
    for array in network.all_networks:
        if isinstance(array, nengo.networks.EnsembleArray):
            yield from array.nodes


def image_hints(image: ChipImage, errors: Sequence[BlockError]) -> Iterator[Violation]:
    """Yield a hint on weights and neurons that rounding, or the network itself, made useless."""
    for block in _blocks_of_zeros(image):
        label = image.manifest.blocks[block].label
        yield rules.get("SP402").broken(label, "all of its weights are 0")
    for error in errors:
        if error.lost_weights > LOST:
            share = f"{100 * error.lost_weights:.0f} % of them"
            yield rules.get("SP403").broken(error.label, share)
    yield from _neurons(image, "SP404", duplicated(image), DUPLICATED)
    yield from _neurons(image, "SP405", silenced(image))


def _blocks_of_zeros(image: ChipImage) -> list[int]:
    """Return the blocks that have synapses, all of weight 0, none of which learns."""
    of_rows = np.repeat(image.groups.block, np.diff(image.groups.row_start))
    block = np.repeat(of_rows, np.diff(image.rows.start))
    weighted = np.unique(block[image.synapses.weight != 0])
    used = np.union1d(weighted, image.groups.block[image.learns])
    zeros: list[int] = np.setdiff1d(np.unique(block), used).tolist()
    return zeros


def _neurons(
    image: ChipImage, rule_id: str, found: np.ndarray, share: float = 0
) -> Iterator[Violation]:
    """Yield the ensembles of which more than a share of neurons is found.

    Relays are left out: a network cannot change their neurons.
    """
    for block, entry in enumerate(image.manifest.blocks):
        mine = found[part(image.blocks.start, block)]
        if mine.mean() > share and entry.kind == "ensemble":
            yield rules.get(rule_id).broken(entry.label, f"{mine.sum():,} of {len(mine):,}")
