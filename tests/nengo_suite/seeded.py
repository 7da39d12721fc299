"""nengo-loihi, building a network without a seed as spikeport does: with seed 0."""

from typing import Any

import nengo
import nengo_loihi


def nengo_loihi_simulator(_request: Any) -> Any:
    """Return a simulator, for the setting ``nengo_simloader`` of Nengo's pytest plugin."""
    return seeded


def seeded(network: nengo.Network, *args: Any, **options: Any) -> nengo_loihi.Simulator:
    """Return the simulator of a network that has a seed now."""
    if network.seed is None:
        network.seed = 0
    return nengo_loihi.Simulator(network, *args, **options)
