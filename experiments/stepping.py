"""A step of a simulator, whose fault is a robot's that has diverged."""

from nengo.exceptions import SimulationError

from spikeport.errors import DivergedError
from spikeport.simulator import Simulator


def advance(sim: Simulator) -> None:
    """Advance a simulator by a step; raises DivergedError if a node returns NaN or infinity."""
    try:
        sim.step()
    except SimulationError as error:
        raise DivergedError(str(error)) from error
