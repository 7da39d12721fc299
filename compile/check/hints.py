"""Hints (rules SP4xx) from a network, its filters, relays and image: parts that compile, but are
lost or left out.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import nengo
import numpy as np
from nengo.connection import LearningRule
from nengo.ensemble import Neurons

from spikeport.compile.check import rules
from spikeport.compile.check.drive import duplicated, silenced
from spikeport.compile.check.loops import LATE, components, loops
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.clusters import removable_clusters
from spikeport.compile.ground.filters import Passage
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.ground.scope import Scope, is_link
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.counted import percent

LOST = 0.1
"""Share of a block's weights above which their loss is worth a hint."""
DUPLICATED = 0.1
"""Share of a block's neurons above which copies are worth a hint: a few come about by rounding."""
BY_PASS = ("direct", "host")
"""Paths that nengo-loihi does not build itself."""
RECTIFIED = (nengo.SpikingRectifiedLinear, nengo.RegularSpiking)
"""Types whose input ordinary Nengo rectifies in every step; subclasses of these need not."""


def network_hints(scope: Scope, remove_passthrough: bool = True) -> Iterator[Violation]:
    """Yield hints on nodes that an image leaves out, and parts unlike float Nengo's."""
    network, names = scope.network, scope.names
    if remove_passthrough:
        for node in _removed(scope):
            yield rules.get("SP401").broken(names[node], "leads nowhere and is not probed")
    for probe in network.all_probes:
        if scope.in_chip_units(probe):
            yield rules.get("SP414").broken(names[probe], probe.attr)
    for connection in _in_cycles(scope):
        yield rules.get("SP416").broken(names[connection], "none")
    for ensemble in _inhibited(scope):
        kind = type(ensemble.neuron_type).__name__
        yield rules.get("SP418").broken(names[ensemble], f"negative weights into {kind}")


def _removed(scope: Scope) -> Iterator[nengo.Node]:
    """Yield the passthrough nodes that lead nowhere: the connections into them are removed, too.

    An array has an output for every function, used or not, so its nodes are left out.
    """
    network = scope.network
    read = {c.pre_obj for c in network.all_connections} | {p.obj for p in network.all_probes}
    fed = {c.post_obj for c in network.all_connections}
    unread = fed - read - set(_nodes_of_arrays(network))
    for cluster, *_ in removable_clusters(scope):
        yield from (node for node in cluster if node in unread)


def _in_cycles(scope: Scope) -> Iterator[nengo.Connection]:
    """Yield one connection of each loop on the chip that has no synapse."""
    direct = [
        c
        for c in scope.network.all_connections
        if c.synapse is None and not isinstance(c.post_obj, LearningRule)
    ]
    for within in loops(direct):
        on_chip = [c for c in within if scope.on_chip(c.post_obj)]
        yield from on_chip[-1:]


def _inhibited(scope: Scope) -> list[nengo.Ensemble]:
    """Return the ensembles on the chip that Nengo rectifies, and other neurons inhibit."""
    direct = (
        connection
        for connection in scope.network.all_connections
        if isinstance(connection.pre_obj, Neurons) and isinstance(connection.post_obj, Neurons)
    )
    found = (
        connection.post_obj.ensemble
        for connection in direct
        if type(connection.post_obj.ensemble.neuron_type) in RECTIFIED
        and scope.on_chip(connection.post_obj)
        and _has_negative(connection.transform)
    )
    return list(dict.fromkeys(found))


def _has_negative(transform: nengo.transforms.Transform) -> bool:
    """Return whether a transform has weights below zero, drawn ones by a sample."""
    if isinstance(transform, nengo.transforms.NoTransform):
        return False
    weights = transform.sample(rng=np.random.RandomState(0))
    values = weights if isinstance(weights, np.ndarray) else weights.data
    return bool((values < 0).any())


def _nodes_of_arrays(network: nengo.Network) -> Iterator[nengo.Node]:
    for array in network.all_networks:
        if isinstance(array, nengo.networks.EnsembleArray):
            yield from array.nodes


def filter_hints(
    passages: Sequence[Passage], dt_s: float, rewritten: bool = False
) -> Iterator[Violation]:
    """Yield a hint on each ensemble that one of several filters slows down, and each slower loop.

    Parameters
    ----------
    passages : sequence of Passage
        The filters of all connections that end on the chip.
    dt_s : float
        The time step, in seconds.
    rewritten : bool
        True if passes rewrote the network: a loop that is slow then stays slow with other passes.
    """
    asked: dict[str, set[float]] = defaultdict(set)
    for one in passages:
        asked[one.target].add(one.target_s)
    for target, found in asked.items():
        if len(found) > 1:
            named = " and ".join(f"{1000 * tau_s:g}" for tau_s in sorted(found))
            yield rules.get("SP409").broken(
                target, f"{named} ms, all filtered with {1000 * max(found):g} ms"
            )
    loop = components([(one.source, one.target) for one in passages if one.source])
    for one in passages:
        before_s = 0.0 if one.relay_s is None else one.relay_s + dt_s
        whole_s = before_s + one.target_s  # a shared filter gets its own hint
        if one.source and loop[one.source] == loop[one.target] and whole_s > (1 + LATE) * one.own_s:
            delays = f"{1000 * one.own_s:g} ms became {1000 * whole_s:g} ms"
            rule = rules.get("SP410")
            slower = rule.broken(one.connection, delays)
            yield slower._replace(cure=rule.in_case["rewritten"]) if rewritten else slower


def path_hints(scope: Scope, chosen: bool) -> Iterator[Violation]:
    """Yield a hint on each connection whose path needs a pass, unless one has ``chosen`` it."""
    settings = NetworkSettings(scope.network)
    for connection in () if chosen else scope.network.all_connections:
        path = settings.get(connection, "decode_path")
        if path in BY_PASS and is_link(connection, scope):
            yield rules.get("SP425").broken(scope.names[connection], path)


def relay_hints(passes: Sequence[Mapping[str, Any]]) -> Iterator[Violation]:
    """Yield a hint on each connection for which a pass chose a path that loses more than a relay.

    ``passes`` are the records of a `spikeport.compile.passes.pipeline.PassRun`.
    """
    found = (one["notes"] for one in passes if one["name"] == "decode_path")
    for name, note in ((name, note) for notes in found for name, note in notes.items()):
        errors = {path["path"]: path["error"] for path in note["paths"]}
        error, usual = errors[note["chosen"]], errors["preset10"]
        if error > usual:
            used = f"{note['chosen']}, {percent(error)} off, as written {percent(usual)}"
            yield rules.get("SP419").broken(name, used)


def image_hints(
    image: ChipImage,
    errors: Sequence[BlockError],
    rounded_away: Sequence[int] = (),
    rewritten: bool = False,
) -> Iterator[Violation]:
    """Yield a hint on weights and neurons that rounding, or the network itself, made useless.

    Parameters
    ----------
    image : ChipImage
        The image, as it was extracted.
    errors : sequence of BlockError
        The rounding error of each block.
    rounded_away : sequence of int
        The groups of synapses whose weights were all rounded to zero.
    rewritten : bool
        True if passes rewrote the network; if not, another cure is to let them.
    """
    entries, zeros = image.manifest.blocks, _blocks_of_zeros(image)
    away = {int(image.groups.block[group]) for group in rounded_away}
    for block in zeros:
        how = "all of its weights are rounded to 0" if block in away else "all of its weights are 0"
        yield rules.get("SP402").broken(entries[block].label, how)
    for group in rounded_away:
        if image.groups.block[group] not in zeros:
            for connection in _connections_into(image, group):
                yield rules.get("SP402").broken(connection, "all of its weights are rounded to 0")
    named = {entries[block].label for block in zeros}
    # The host reads states in the units of the builder, so no pass scales these rows.
    unscaled = {entry.label for entry in entries if entry.kind == "readout"}
    for error in errors:
        if error.lost_weights > LOST and error.label not in named:
            rule, share = rules.get("SP403"), f"{100 * error.lost_weights:.0f} % of them"
            broken = rule.broken(error.label, share)
            scales = not rewritten and error.label not in unscaled
            yield broken.or_else(rule.in_case["as_written"]) if scales else broken
    yield from _neurons(image, "SP404", duplicated(image), DUPLICATED)
    yield from _neurons(image, "SP405", silenced(image))


def _connections_into(image: ChipImage, group: int) -> list[str]:
    """Return the names of the connections into a group of synapses."""
    entries, routes = image.manifest, image.routes
    target = entries.blocks[image.groups.block[group]].label
    mine = np.flatnonzero(routes.group == group)
    names = []
    for source, from_input in zip(routes.source[mine], routes.from_input[mine], strict=True):
        if from_input:
            name = entries.inputs[source].name
            is_connection = " -> " in name  # else a node's, whose events come from a file
        else:
            name = entries.blocks[source].label
            is_connection = entries.blocks[source].kind == "relay"
        names.append(name if is_connection else f"{name} -> {target}")
    return list(dict.fromkeys(names))


def _blocks_of_zeros(image: ChipImage) -> Collection[int]:
    """Return the blocks that have synapses, but only synapses of weight 0 that do not learn."""
    block = np.repeat(image.groups.block[image.row_group], np.diff(image.rows.start))
    weighted = np.unique(block[image.synapses.weight != 0])
    used = np.union1d(weighted, image.groups.block[image.learns])
    return dict.fromkeys(np.setdiff1d(np.unique(block), used).tolist())


def _neurons(
    image: ChipImage, rule_id: str, found: np.ndarray, share: float = 0
) -> Iterator[Violation]:
    """Yield a hint on each ensemble in which more than a share of the neurons was found.

    Relays are left out: a network cannot change their neurons.
    """
    for block, entry in enumerate(image.manifest.blocks):
        mine = found[part(image.blocks.start, block)]
        if mine.mean() > share and entry.kind == "ensemble":
            yield rules.get(rule_id).broken(entry.label, f"{mine.sum():,} of {len(mine):,}")
