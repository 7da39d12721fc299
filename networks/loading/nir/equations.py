"""NIR's own equations, by Euler's method, for as many steps as the inputs have.

Delays that all paths share (`spikeport.networks.loading.nir.checks`) are left out.
Within a step populations are computed in order; an edge that closes a cycle takes one step.
"""

from collections.abc import Mapping

import numpy as np

from spikeport.networks.loading.nir.populations import Population, PopulationGraph


def run(graph: PopulationGraph, inputs: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Run a graph from rest.

    Parameters
    ----------
    graph : PopulationGraph
        The graph.
    inputs : mapping of str to (n_steps, size) array
        The spikes of each input, 0 or 1.

    Returns
    -------
    outputs : dict of str to (n_steps, n) array
        The spikes of each population, or the voltage of a read-out.
    """
    n_steps = min(len(rows) for rows in inputs.values())
    states = {name: _State(one) for name, one in graph.populations.items()}
    outputs = {name: np.zeros((n_steps, one.size)) for name, one in graph.populations.items()}
    sent = {name: np.zeros(one.size) for name, one in graph.populations.items()}
    for step in range(n_steps):
        sent |= {name: rows[step] for name, rows in inputs.items()}
        for name, state in states.items():
            sent[name] = outputs[name][step] = state.step(sent)
    return outputs


class _State:
    """The current and voltage of a population."""

    def __init__(self, population: Population) -> None:
        self._of = population
        self._current = np.zeros(population.size)
        self._voltage = -population.dynamics.reset  # zero, relative to the reset voltage

    def step(self, sent: Mapping[str, np.ndarray]) -> np.ndarray:
        signal, of = self._of.input, self._of.dynamics
        x = sum((matrix @ sent[name] for name, matrix in signal.parts.items()), signal.constant)
        self._current = self._current + of.gain * x - of.current_decay * self._current
        self._voltage = self._voltage + self._current - of.voltage_decay * self._voltage + of.leak
        if not self._of.spikes:
            return self._voltage
        spiked = self._voltage > of.threshold
        self._voltage = np.where(spiked, 0, self._voltage)
        return spiked.astype(float)
