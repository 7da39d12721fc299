"""Arm, path follower and walking policy in one network, and basal ganglia that choose among them.

    torque = arm(state, target)                               while "draw" is selected, else 0
    command = follower(reference, state)                      while "walk" is selected, else 0
    action = policy(observation) + bias                       likewise, or always

Gating is on the chip: gates of the actions that are not selected silence the neurons
(`spikeport.networks.gating`). A constant would bypass a gate, so the policy's output bias comes
from neurons, too. With ``balances`` set, the policy is not gated: at zero command it keeps the
robot standing while the arm draws.

Source: paper, sec. 3.3.
"""

import dataclasses
from dataclasses import dataclass

import nengo
import numpy as np

from spikeport.networks.action_selection import (
    SelectionNetwork,
    SelectionOptions,
    action_selection,
)
from spikeport.networks.arm import ArmNetwork
from spikeport.networks.gating import full_rate_ensemble, gate
from spikeport.networks.path_follower import FollowerNetwork
from spikeport.networks.policy import Layer, PolicyNetwork
from spikeport.networks.solvers import Tied
from spikeport.networks.spa_selection import spa_action_selection

ACTIONS = ("walk", "draw")
OF_TWO = SelectionOptions(thalamus_s=0.002)
"""Between two actions a fast thalamus decides sooner: at utilities of 0.8 and 0.7 within 39 ms; the
default takes up to 47 ms. Among more actions it hesitates."""


@dataclass(frozen=True)
class HumanoidOptions:
    """The choice of gated outputs, and the time constants of gates and of the bias in seconds.

    ``tau_walk`` is the filter of the policy's gates, ``tau_arm`` that of the arm's. Each equals the
    filter of the layers it silences (an ensemble on the chip has one). With ``spa``, nengo_spa's
    own basal ganglia select, in float Nengo, instead of those with the options ``selection``.
    """

    balances: bool = False
    tau_walk: float = 0.002
    tau_arm: float = 0.005
    tau_bias: float = 0.005
    selection: SelectionOptions = OF_TWO
    spa: bool = False


class HumanoidNetwork(nengo.Network):
    """The whole network, with the input ``utilities`` (2) of `ACTIONS` and its parts' inputs.

    The parts' inputs are ``arm.state``, ``arm.target``, ``follower.reference``, ``follower.state``
    and ``observation``, which holds the command. ``gates`` (2) is 1 for the selected action;
    ``torque`` (4), ``command`` (2) and ``action`` (19) are the outputs of arm, follower and policy.
    """

    arm: ArmNetwork
    follower: FollowerNetwork
    policy: PolicyNetwork
    selection: SelectionNetwork
    utilities: nengo.Node
    gates: nengo.Node
    observation: nengo.Node
    torque: nengo.Node
    command: nengo.Node
    action: nengo.Node


def without_bias(layer: Layer) -> Layer:
    """Return a policy's last layer without its bias, which `humanoid` adds."""
    return dataclasses.replace(layer, bias=np.zeros_like(layer.bias))


def humanoid(
    arm: ArmNetwork,
    follower: FollowerNetwork,
    policy: PolicyNetwork,
    bias: np.ndarray,
    options: HumanoidOptions | None = None,
    seed: int = 0,
) -> HumanoidNetwork:
    """Put the parts together.

    Parameters
    ----------
    arm, follower, policy : nengo.Network
        The parts, not yet in any network; the policy's last layer is made by `without_bias`.
    bias : (19,) array
        The bias of that layer.
    options : HumanoidOptions, optional
        The parts that are gated, and their gates.
    seed : int
        Seed of the selection.
    """
    options = options or HumanoidOptions()
    net = HumanoidNetwork(label="humanoid", seed=seed)
    with net:
        net.arm, net.follower, net.policy = arm, follower, policy
        for part in (arm, follower, policy):
            net.add(part)
        if options.spa:
            net.selection = spa_action_selection(len(ACTIONS), seed)
        else:
            net.selection = action_selection(len(ACTIONS), options.selection, seed)
        constant = _constant(bias, policy.action, options.tau_bias)
        # An action's gates fire while it is not selected, and silence the part that performs it.
        walk, draw = net.selection.nuclei["gate"]
        gate(draw, [e for group in arm.groups.values() for e in group], synapse=options.tau_arm)
        for tau, ensembles in follower.filters.items():
            gate(walk, ensembles, synapse=tau)
        if not options.balances:
            gate(walk, [*policy.all_ensembles, constant], synapse=options.tau_walk)
    net.utilities, net.gates = net.selection.utilities, net.selection.gates
    net.observation, net.action = policy.observation, policy.action
    net.torque, net.command = arm.torque, follower.command
    return net


def _constant(values: np.ndarray, target: nengo.Node, tau: float) -> nengo.Ensemble:
    """Return neurons that add constant values to a node for as long as nothing silences them."""
    always = full_rate_ensemble("bias of action", always=True)
    nengo.Connection(
        always,
        target,
        function=np.ones((1, 1)),
        eval_points=always.eval_points,
        solver=Tied(),
        transform=values[:, np.newaxis],
        synapse=tau,
    )
    return always
