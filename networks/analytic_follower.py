"""The path follower's inputs and output, and the path follower without neurons."""

from collections.abc import Callable

import nengo
import numpy as np

from spikeport.networks.path_following import (
    COMMAND_SIZE,
    REFERENCE_SIZE,
    STATE_SIZE,
    FollowerGains,
    exact_command,
)
from spikeport.node_functions import Held


class FollowerNetwork(nengo.Network):
    """A path follower with the inputs ``reference`` and ``state`` and the output ``command``.

    ``reference`` takes planar position (m) and velocity (m/s) of the point to follow, ``state`` the
    robot's heading (rad), planar position (m) and velocity (m/s), all in the world frame;
    ``command`` gives forward speed (m/s) and yaw rate (rad/s). ``filters`` maps the time constant
    in s of an input to the ensembles that have it.
    """

    reference: nengo.Node
    state: nengo.Node
    command: nengo.Node
    filters: dict[float, list[nengo.Ensemble]]


def analytic_follower(gains: FollowerGains) -> FollowerNetwork:
    """Return the path follower without neurons: the exact law, one step late."""

    def law(values: np.ndarray) -> np.ndarray:
        return exact_command(gains, values[:REFERENCE_SIZE], values[REFERENCE_SIZE:])

    net, command = from_inputs("analytic follower", law, COMMAND_SIZE)
    with net:
        nengo.Connection(command, net.command, synapse=0)  # a step of delay: no algebraic loop
    return net


def from_inputs(
    label: str, function: Callable[[np.ndarray], np.ndarray], size: int, seed: int = 0
) -> tuple[FollowerNetwork, nengo.Node]:
    """Return a network with inputs, an output, and a node that applies a function to all inputs."""
    net = FollowerNetwork(label=label, seed=seed)
    with net:
        net.reference = nengo.Node(size_in=REFERENCE_SIZE, label="reference")
        net.state = nengo.Node(size_in=STATE_SIZE, label="state")
        net.command = nengo.Node(size_in=COMMAND_SIZE, label="command")
        net.filters = {}
        computed = nengo.Node(
            Held(function), size_in=REFERENCE_SIZE + STATE_SIZE, size_out=size, label="from inputs"
        )
        nengo.Connection(net.reference, computed[:REFERENCE_SIZE], synapse=None)
        nengo.Connection(net.state, computed[REFERENCE_SIZE:], synapse=None)
    return net, computed
