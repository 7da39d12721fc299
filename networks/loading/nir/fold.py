"""A graph without its linear nodes: its populations, in the order in which they compute."""

import itertools
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


def _order(sources: dict[str, list[str]], edges: Sequence[tuple[str, str]]) -> list[str]:
    """Return populations in an order in which each comes after its sources, except in cycles.

    In a cycle, the edge by which a depth-first walk from the inputs returns to a node on its path
    is ignored. The walk takes edges in the order of the file, so that no name decides.
    """
    names = {*sources, *(one for before in sources.values() for one in before)}
    found = dict.fromkeys([*itertools.chain.from_iterable(edges), *sorted(names)])
    # A population may have no edge.
    after: dict[str, list[str]] = {name: [] for name in found if name in names}
    for name in after:
        for source in sources.get(name, ()):
            after[source].append(name)
    inputs = [name for name in after if name not in sources]
    started: set[str] = set()
    done = [one for name in [*inputs, *after] for one in _postorder(name, after, started)]
    return [name for name in reversed(done) if name in sources]


def _postorder(start: str, after: dict[str, list[str]], started: set[str]) -> Iterator[str]:
    """Yield nodes that a depth-first walk from `start` reaches first, each after its successors."""
    path = [] if start in started else [(start, iter(after[start]))]
    started.add(start)
    while path:
        name, rest = path[-1]
        following = next((one for one in rest if one not in started), None)
        if following is None:
            yield name
            path.pop()
        else:
            started.add(following)
            path.append((following, iter(after[following])))
