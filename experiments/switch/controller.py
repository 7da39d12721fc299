"""The controller of a switching run: the humanoid in spikes, or the exact controllers."""

import dataclasses
from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.experiments.switch.rehearsal import ExactControllers
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.walk.controller import analytic_policy
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
from spikeport.networks.policy import Layer, Ranges, policy
from spikeport.networks.region import ArmRegion


def spiking_humanoid(
    settings: SwitchSettings,
    exact: ExactControllers,
    region: ArmRegion,
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
) -> HumanoidNetwork:
    """Build the humanoid in spikes.

    Parameters
    ----------
    settings : SwitchSettings
        Sizes, filters and seed.
    exact : ExactControllers
        The exact controllers.
    region : ArmRegion
        States of the arm.
    layers, ranges
        The policy's layers as they were solved, and the ranges of its units.
    """
    # The last layer's bias is a constant, which no gate could silence: it comes from neurons of its
    # own.
    *hidden, last = layers
    seed, options = settings.network_seed, settings.policy_options
    as_they_are = dataclasses.replace(options, solve="unit")
    return humanoid(
        arm(exact.law, region, PRESETS[settings.preset], seed=seed),
        path_follower(exact.policy.gains, seed=seed),
        policy([*hidden, without_bias(last)], ranges, as_they_are, seed),
        last.bias,
        HumanoidOptions(
            balances=not settings.anchor,
            tau_walk=settings.tau_fwd,
            spa=settings.selection == "spa",
        ),
        seed,
    )


def analytic_humanoid(exact: ExactControllers, balances: bool) -> HumanoidNetwork:
    """Build the humanoid without neurons: the exact controllers, and an immediate selection."""
    net = HumanoidNetwork(label="analytic humanoid")
    with net:
        net.arm, net.policy = analytic_arm(exact.law), analytic_policy(exact.policy)
        net.follower = analytic_follower(exact.policy.gains)
        net.observation = net.policy.observation
        net.selection = _analytic_selection()
        net.utilities, net.gates = net.selection.utilities, net.selection.gates
        walk, draw = net.gates[0], net.gates[1]
        net.torque = _gated(net.arm.torque, draw)
        net.command = _gated(net.follower.command, walk)
        net.action = net.policy.action if balances else _gated(net.policy.action, walk)
    return net


def _analytic_selection() -> SelectionNetwork:
    net = SelectionNetwork(label="analytic selection")
    with net:
        net.utilities = nengo.Node(size_in=len(ACTIONS), label="utilities")
        chosen = nengo.Node(_highest, size_in=len(ACTIONS), label="highest")
        net.gates = nengo.Node(size_in=len(ACTIONS), label="gates")
        nengo.Connection(net.utilities, chosen, synapse=None)
        nengo.Connection(chosen, net.gates, synapse=0)  # a step of delay: no algebraic loop
        net.nuclei = {}
    return net


def _highest(_t: float, utilities: np.ndarray) -> np.ndarray:
    return np.asarray(np.eye(len(utilities))[utilities.argmax()])


def _gated(values: nengo.Node, gate: nengo.base.ObjView) -> nengo.Node:
    """Return a node with the values while a gate is 1, and with zeros while it is 0."""
    size = values.size_out
    product = nengo.Node(lambda _t, x: x[:-1] * x[-1], size_in=size + 1, size_out=size)
    nengo.Connection(values, product[:-1], synapse=None)
    nengo.Connection(gate, product[-1], synapse=None)
    return product
