"""What compiles, but is lost or left out: rules SP4xx, found in the network and in its image."""

from collections.abc import Iterator, Sequence

import nengo
import numpy as np

from spikeport.compile.image import ChipImage
from spikeport.compile.names import Names
from spikeport.compile.quantisation import BlockError
from spikeport.compile.verdict import rules
from spikeport.compile.verdict.drive import duplicated, silenced
from spikeport.compile.verdict.violation import Violation

ARROW = " -> "
LOST = 0.1
"""Share of a block's weights above which their loss is worth a hint."""


def network_hints(network: nengo.Network, names: Names) -> Iterator[Violation]:
    """Passthrough nodes that nengo-loihi removes with all that leads to them.

    Not those of ensemble arrays, which have an output for every function, used or not.
    """
    read = {c.pre_obj for c in network.all_connections} | {p.obj for p in network.all_probes}
    fed = {c.post_obj for c in network.all_connections}
    for node in network.all_nodes:
        if node.output is None and node in fed - read - set(_nodes_of_arrays(network)):
            yield rules.get("SP401").broken(names[node], "leads nowhere and is not probed")


def _nodes_of_arrays(network: nengo.Network) -> Iterator[nengo.Node]:
    for part in network.all_networks:
        if isinstance(part, nengo.networks.EnsembleArray):
            yield from part.nodes


def image_hints(image: ChipImage, errors: Sequence[BlockError]) -> Iterator[Violation]:
    """Weights and neurons that rounding, or the network as it was written, made useless."""
    for block in _blocks_of_zeros(image):
        label = image.manifest["blocks"][block]["label"]
        yield rules.get("SP402").broken(label, "all of its weights are 0")
    for error in errors:
        if error.lost_weights > LOST:
            share = f"{100 * error.lost_weights:.0f} % of them"
            yield rules.get("SP403").broken(error.label, share)
    yield from _neurons(image, "SP404", duplicated(image))
    yield from _neurons(image, "SP405", silenced(image))


def _blocks_of_zeros(image: ChipImage) -> list[int]:
    """Blocks that have synapses, all of weight 0."""
    group = np.repeat(np.arange(len(image["synapse_block"])), np.diff(image["row_start"]))
    of_rows = image["synapse_block"][group]
    block = np.repeat(of_rows, np.diff(image["row_weight_start"]))
    weighted = np.unique(block[image["weights"] != 0])
    return np.setdiff1d(np.unique(block), weighted).tolist()


def _neurons(image: ChipImage, rule_id: str, found: np.ndarray) -> Iterator[Violation]:
    """Ensembles with such neurons; those of relays are not for the network to change."""
    for block, entry in enumerate(image.manifest["blocks"]):
        part = found[image.part("block_start", block)]
        if part.any() and ARROW not in entry["label"]:
            yield rules.get(rule_id).broken(entry["label"], f"{part.sum():,} of {len(part):,}")
