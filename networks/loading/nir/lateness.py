"""Steps by which populations of a graph are late, and by which spikes arrive early or late.

In NIR, paths within a step take no time; on the chip each connection takes a step. The host holds
inputs back to make up for it.
"""

from collections.abc import Collection, Iterator

from spikeport.networks.loading.nir.populations import Population, PopulationGraph


class Lateness:
    """The steps by which the populations of a graph are late, relative to NIR.

    Parameters
    ----------
    graph : PopulationGraph
        The graph.
    moved : collection of str
        The populations that ``--offload`` moved to the host.

    Attributes
    ----------
    steps : dict of str to int
        The steps by which each population is late: its depth, if none was moved.
    """

    def __init__(self, graph: PopulationGraph, moved: Collection[str] = ()) -> None:
        self._graph, self._moved = graph, moved
        self.steps: dict[str, int] = {}
        self._places: dict[str, int] = {}
        for name, one in graph.populations.items():
            before = [
                self.steps[source] + self._between(source, name)
                for source in one.input.parts
                if source in self.steps
            ]
            self._places[name] = len(self.steps)
            self.steps[name] = max(before, default=1)

    def leads(self, population: Population) -> Iterator[tuple[str, int]]:
        """Yield each source whose spikes arrive early, with the number of steps; negative if late.

        Early and late are relative to the spikes on the longest path to the population.
        """
        name = population.node.name
        for source in population.input.parts:
            if source in self._places:
                # In NIR, the edge that closes a cycle takes a step, too.
                closes = self._places[source] >= self._places[name]
                arrival = self.steps[source] + self._between(source, name) - closes
            else:
                arrival = self._graph.held_steps(population) + population.spikes
            if arrival != self.steps[name]:
                yield source, self.steps[name] - arrival

    def output_leads(self, name: str) -> Iterator[tuple[str, int]]:
        """Yield each source that reaches an output earlier than another, with the steps."""
        arrivals = {one: self._at_outputs(one) for one in self._graph.outputs[name].parts}
        latest = max(arrivals.values(), default=0)
        for source, arrival in arrivals.items():
            if arrival < latest:
                yield source, latest - arrival

    def _between(self, source: str, name: str) -> int:
        """Return the steps that spikes of a population take to another.

        To leave the chip takes a step, and so does the filter of neurons, which read-outs lack.
        """
        spikes = self._graph.populations[name].spikes
        leaves = source not in self._moved and (name in self._moved or not spikes)
        return int(leaves) + int(spikes)

    def _at_outputs(self, source: str) -> int:
        """Return the steps by which an output gets a source late."""
        if source not in self.steps:
            return 0
        leaves = self._graph.populations[source].spikes and source not in self._moved
        return self.steps[source] + int(leaves)
