"""What drives the robot in a switching run: the humanoid in spikes, or the exact controllers."""

import nengo
import numpy as np

from spikeport.experiments.switch.rehearsal import Exact, rehearse
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.experiments.walk.calibration import policy_layers
from spikeport.experiments.walk.controller import analytic_policy
from spikeport.experiments.walk.gait import encoding, record_gait
from spikeport.networks.action_selection import SelectionNetwork
from spikeport.networks.arm import PRESETS, analytic_arm, arm
from spikeport.networks.humanoid import (
    ACTIONS,
    HumanoidNetwork,
    HumanoidOptions,
    humanoid,
    without_bias,
)
from spikeport.networks.path_follower import analytic_follower, path_follower
from spikeport.networks.policy import PolicyOptions, policy, record_ranges
from spikeport.networks.region import Box


def spiking_humanoid(trial: SwitchTrial, exact: Exact) -> tuple[HumanoidNetwork, Box]:
    """The humanoid in spikes, made for the states that the exact controllers come by.

    The policy is made for walking alone: what it is told of an arm at work is clipped.

    Returns
    -------
    network : HumanoidNetwork
        The humanoid.
    encoding : Box
        The range of what its policy can be told.
    """
    settings, options = trial.settings, trial.options
    options.progress("recording the gait of the exact policy", None)
    gait = record_gait(exact.policy)
    options.progress("rehearsing with the exact controllers", None)
    region = rehearse(trial, exact)
    options.progress("building the controller", None)
    seed, layers = settings.network_seed, policy_layers(exact.policy)
    *hidden, last = layers
    units = PolicyOptions(n_neurons=settings.n_neurons)
    net = humanoid(
        arm(exact.law, region, PRESETS[settings.preset], seed=seed),
        path_follower(exact.gains, seed=seed),
        policy([*hidden, without_bias(last)], record_ranges(layers, gait), units, seed),
        last.bias,
        HumanoidOptions(balances=not settings.anchor),
        seed,
    )
    return net, encoding(gait)


def analytic_humanoid(exact: Exact, balances: bool) -> HumanoidNetwork:
    """The humanoid without neurons: the exact controllers, and a selection that is immediate."""
    with HumanoidNetwork(label="analytic humanoid") as net:
        net.arm, net.policy = analytic_arm(exact.law), analytic_policy(exact.policy)
        net.follower = analytic_follower(exact.gains)
        net.observation = net.policy.observation
        net.selection = _analytic_selection()
        net.utilities, net.gates = net.selection.utilities, net.selection.gates
        walk, draw = net.gates[0], net.gates[1]
        net.torque = _gated(net.arm.torque, draw)
        net.command = _gated(net.follower.command, walk)
        net.action = net.policy.action if balances else _gated(net.policy.action, walk)
    return net


def _analytic_selection() -> SelectionNetwork:
    with SelectionNetwork(label="analytic selection") as net:
        net.utilities = nengo.Node(size_in=len(ACTIONS), label="utilities")
        chosen = nengo.Node(_highest, size_in=len(ACTIONS), label="highest")
        net.gates = nengo.Node(size_in=len(ACTIONS), label="gates")
        nengo.Connection(net.utilities, chosen, synapse=None)
        nengo.Connection(chosen, net.gates, synapse=0)  # a step of delay: no algebraic loop
        net.nuclei = {}
    return net


def _highest(_t: float, utilities: np.ndarray) -> np.ndarray:
    return np.eye(len(utilities))[utilities.argmax()]


def _gated(values: nengo.Node, gate: nengo.base.ObjView) -> nengo.Node:
    """The values where a gate is 1, and nothing where it is 0."""
    size = values.size_out
    product = nengo.Node(lambda _t, x: x[:-1] * x[-1], size_in=size + 1, size_out=size)
    nengo.Connection(values, product[:-1], synapse=None)
    nengo.Connection(gate, product[-1], synapse=None)
    return product
