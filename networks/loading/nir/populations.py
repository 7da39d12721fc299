"""Populations of neurons with one sparse matrix between two of them."""

from dataclasses import dataclass

import numpy as np

from spikeport.networks.loading.nir.dynamics import Dynamics
from spikeport.networks.loading.nir.graph import READOUTS, Node
from spikeport.networks.loading.nir.operators import Shape
from spikeport.networks.loading.nir.signals import Signal
from spikeport.neurons import MOST_HELD_STEPS

CONSTANTS: tuple[tuple[str, int, int | None], ...] = (
    ("bias", 0, None),
    ("start", 0, 1),
    ("second step", 1, 1),
)
"""Constant inputs: name, first step, and number of steps (None: to the end)."""


@dataclass(frozen=True)
class Population:
    """Neurons of one node, and their input.

    Attributes
    ----------
    node : Node
        The node.
    dynamics : Dynamics
        Its equations in a time step.
    input : Signal
        Its input.
    depth : int
        The longest path of spikes from an input to it, in connections.
    """

    node: Node
    dynamics: Dynamics
    input: Signal
    depth: int

    @property
    def size(self) -> int:
        """The number of neurons."""
        return self.dynamics.size

    @property
    def spikes(self) -> bool:
        """True if the neurons spike, False if their voltages are read."""
        return self.node.kind not in READOUTS

    def constants(self) -> np.ndarray:
        """Return the `CONSTANTS` of its neurons' currents, (3, n), in units of the voltage.

        A leak is a constant current that has its full size in the first step. NIR's voltages begin
        at 0, but voltages are relative to the reset voltage here: where it is not 0, a current in
        the first step alone makes up for it.
        """
        of = self.dynamics
        filtered, start = 1 - of.current_decay, -(1 - of.voltage_decay) * of.reset
        bias = of.gain * self.input.constant + of.current_decay * of.leak
        return np.array([bias, filtered * of.leak + start, -filtered * start])


@dataclass(frozen=True)
class PopulationGraph:
    """A graph of populations.

    Attributes
    ----------
    dt_s : float
        The time step, in seconds.
    inputs : dict of str to Shape
        The shape of each input.
    populations : dict of str to Population
        The populations by name, each after its sources, except in cycles.
    outputs : dict of str to Signal
        The signals that are read.
    """

    dt_s: float
    inputs: dict[str, Shape]
    populations: dict[str, Population]
    outputs: dict[str, Signal]

    def held_steps(self, population: Population) -> int:
        """Return the steps by which the host holds the inputs of a population back."""
        return min(population.depth - population.spikes, MOST_HELD_STEPS)
