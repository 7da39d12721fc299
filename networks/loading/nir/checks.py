"""Checks of a graph of populations, which refuse graphs that a chip with its host cannot run."""

import math
from collections.abc import Mapping

from spikeport.networks.loading.nir.operators import SIZE
from spikeport.networks.loading.nir.populations import Population, PopulationGraph
from spikeport.networks.loading.nir.signals import Signal, unequal_delays
from spikeport.reading.mismatch import MismatchError


def check_readouts(populations: Mapping[str, Population]) -> None:
    """Refuse voltages of read-outs as inputs of neurons."""
    for name, population in populations.items():
        for source in population.input.parts:
            if source in populations and not populations[source].spikes:
                raise MismatchError(
                    f"spikes into node {name}",
                    f"the voltage of {populations[source].node.kind} {source}",
                    cure="neurons on the chip send only spikes: connect the read-out to an Output "
                    "instead, or make it a LIF",
                )


def check_outputs(graph: PopulationGraph) -> None:
    """Refuse outputs that add voltages to spikes, which are 1/dt high, as in Nengo."""
    for name, signal in graph.outputs.items():
        voltages = [one for one in signal.parts if not _spikes(graph, one)]
        if voltages and len(voltages) < len(signal.parts):
            raise MismatchError(
                f"spikes alone or voltages alone into node {name}",
                f"both, a voltage of {voltages[0]} among them",
                cure="give each an Output of its own, and add them outside of the graph",
            )


def _spikes(graph: PopulationGraph, source: str) -> bool:
    return source in graph.inputs or graph.populations[source].spikes


def check_delays(graph: PopulationGraph) -> None:
    """Refuse a node whose inputs arrive with different delays.

    A delay that all paths share is ignored. The edge that closes a cycle takes one step anyway, so
    the delays in a cycle may sum to one step, or to none.
    """
    since = dict.fromkeys(graph.inputs, 0)
    for name, one in graph.populations.items():
        since[name] = _delay(name, one.input, since)
    for name, signal in graph.outputs.items():
        _delay(name, signal, since)
    for name, one in graph.populations.items():
        around = {s: since[s] + n - since[name] for s, n in one.input.delays.items()}
        for source, n in around.items():
            if n > 1:
                raise MismatchError(f"at most 1 delay in the cycle of {source} and {name}", f"{n}")


def _delay(name: str, signal: Signal, since: Mapping[str, int]) -> int:
    """Return the steps by which a node's input is delayed, from the delays of its sources."""
    found = sorted({since[one] + n for one, n in signal.delays.items() if one in since})
    if len(found) > 1:
        raise unequal_delays(name, found)
    return found[0] if found else 0


def check_held(graph: PopulationGraph) -> None:
    """Refuse too many inputs for the host to hold back; each counts once per number of steps."""
    paths = {
        (name, graph.held_steps(one))
        for one in graph.populations.values()
        for name in one.input.parts
        if name in graph.inputs
    }
    n = sum(math.prod(graph.inputs[name]) for name, _ in paths)
    if n > SIZE:
        raise MismatchError(
            f"at most {SIZE:,} inputs, counting an input once for each of its delays", f"{n:,}"
        )
