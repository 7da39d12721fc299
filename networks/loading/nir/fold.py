"""A graph without its linear nodes: its populations, in the order in which they compute."""

from collections.abc import Iterator, Sequence

from spikeport.networks.loading.nir.checks import (
    check_delays,
    check_held,
    check_outputs,
    check_readouts,
)
from spikeport.networks.loading.nir.dynamics import dynamics
from spikeport.networks.loading.nir.graph import NEURONS, Graph
from spikeport.networks.loading.nir.populations import Population, PopulationGraph
from spikeport.networks.loading.nir.signals import Signals


def fold(graph: Graph, dt_s: float) -> PopulationGraph:
    """Fold the linear nodes of a graph into matrices between its populations.

    Raises
    ------
    MismatchError
        Shapes do not fit, or something cannot be put on a chip: the message names the node.
    """
    signals = Signals(graph, dt_s)
    inputs = {node.name: signals.shapes[node.name] for node in graph.kinds("Input")}
    found = {
        node.name: dynamics(node, signals.shapes[node.name], dt_s) for node in graph.kinds(*NEURONS)
    }
    into = {name: signals.into(name) for name in found}
    depths: dict[str, int] = {}
    populations = {}
    for name in _order({name: list(one.parts) for name, one in into.items()}, graph.edges):
        before = [depths.get(source, 0) for source in into[name].parts]
        depths[name] = 1 + max(before, default=0)
        populations[name] = Population(graph.nodes[name], found[name], into[name], depths[name])
    outputs = {node.name: signals.into(node.name) for node in graph.kinds("Output")}
    check_readouts(populations)
    folded = PopulationGraph(dt_s, inputs, populations, outputs)
    check_outputs(folded)
    check_delays(folded)
    check_held(folded)
    return folded


def _order(sources: dict[str, list[str]], edges: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield populations in an order in which each comes after its sources, except in cycles.

    A cycle begins at its population nearest to the inputs; among several, at the one to which the
    first edge leads. Names decide nothing.
    """
    steps = _steps_from_inputs(sources)
    first: dict[str, int] = {}
    for number, (_, target) in enumerate(edges):
        first.setdefault(target, number)
    left = dict(sources)
    while left:
        ready = [name for name, before in left.items() if not (left.keys() & before) - {name}]
        if not ready:
            ahead = {name: _ahead(name, left) for name in left}
            # Of all cycles, one that no other leads to has the fewest populations ahead.
            within = [name for name in left if name in ahead[name]]
            ready = [min(within, key=lambda n: (len(ahead[n]), steps.get(n, len(left)), first[n]))]
        for name in ready:
            yield name
            del left[name]


def _steps_from_inputs(sources: dict[str, list[str]]) -> dict[str, int]:
    """Return the fewest connections from an input to each population that one reaches."""
    found: dict[str, int] = {}
    reached = {one for before in sources.values() for one in before} - sources.keys()
    while reached:
        steps = max(found.values(), default=0) + 1
        reached = {n for n, before in sources.items() if n not in found and reached & {*before}}
        found |= dict.fromkeys(reached, steps)
    return found


def _ahead(name: str, left: dict[str, list[str]]) -> set[str]:
    """Return the populations that are left, and from which a path leads to one of them."""
    found: set[str] = set()
    new = left.keys() & left[name]
    while new:
        found |= new
        new = {one for each in new for one in left[each] if one in left} - found
    return found
