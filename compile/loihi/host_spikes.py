"""Spikes that ensembles on the host send to the chip."""

from collections import Counter, defaultdict
from collections.abc import Mapping

import nengo

from spikeport.compile.ground.names import Named, base
from spikeport.compile.ground.scope import is_passthrough
from spikeport.compile.loihi.ordered_model import OrderedModel


def host_spikes(model: OrderedModel) -> Counter[nengo.Ensemble]:
    """Return the largest number of spikes that ensembles on the host send to the chip in a step.

    An ensemble's values that pass through nodes on the host are counted where they enter the chip.
    """
    followers: dict[Named, set[Named]] = defaultdict(set)
    for connection in model.toplevel.all_connections:
        followers[base(connection.pre_obj)].add(base(connection.post_obj))
    counts: Counter[nengo.Ensemble] = Counter()
    ensembles = [e for e in model.toplevel.all_ensembles if not model.split.on_chip(e)]
    for ensemble in ensembles:
        senders = _through_nodes(ensemble, followers)
        for source in model.inputs:
            crossing = model.crossings[source]
            # The spikes of a camera enter by its node, which no ensemble drives.
            if isinstance(crossing, nengo.Connection) and base(crossing.pre_obj) in senders:
                counts[ensemble] += int(source.n_neurons)
    return counts


def _through_nodes(ensemble: nengo.Ensemble, followers: Mapping[Named, set[Named]]) -> set[Named]:
    """Return an ensemble and the passthrough nodes that it reaches directly or through others."""
    reached: set[Named] = set()
    ahead: list[Named] = [ensemble]
    while ahead:
        obj = ahead.pop()
        if obj not in reached:
            reached.add(obj)
            ahead += filter(is_passthrough, followers[obj])
    return reached
