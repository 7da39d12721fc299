"""What drives the robot in a switching run: the humanoid in spikes, or the exact controllers."""

import dataclasses

import nengo
import numpy as np

from spikeport.experiments.calibration import Calibration
from spikeport.experiments.policy.readout import calibrated, policy_layers, refitted
from spikeport.experiments.switch.rehearsal import Exact, rehearse, walks
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.experiments.walk.controller import analytic_policy
from spikeport.experiments.walk.gait import encoding
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
from spikeport.networks.policy import policy, record_ranges, solved_layers
from spikeport.networks.region import Box


def spiking_humanoid(trial: SwitchTrial, exact: Exact) -> tuple[HumanoidNetwork, Box]:
    """The humanoid in spikes, made for the states that the exact controllers come by.

    Returns
    -------
    network : HumanoidNetwork
        The humanoid.
    encoding : Box
        The range of what its policy can be told.
    """
    settings, seed = trial.settings, trial.settings.network_seed
    rehearsed = rehearse(trial, exact)
    layers, gait = policy_layers(exact.policy), rehearsed.observations
    ranges, options = record_ranges(layers, gait), settings.policy_options
    # made before: layers are solved for, and a policy calibrated, in networks of their own
    solved = solved_layers(layers, ranges, options, seed, gait)
    found = calibrated(trial, layers, ranges, gait, walks(trial, exact))
    *hidden, last = found.of(solved) if found else solved
    trial.options.progress("building the controller", None)
    as_they_are = dataclasses.replace(options, solve="unit")
    net = humanoid(
        arm(exact.law, rehearsed.region, PRESETS[settings.preset], seed=seed),
        path_follower(exact.gains, seed=seed),
        policy([*hidden, without_bias(last)], ranges, as_they_are, seed),
        last.bias,
        HumanoidOptions(balances=not settings.anchor, tau_walk=settings.tau_fwd),
        seed,
    )
    return net, encoding(gait)


def calibrate(trial: SwitchTrial) -> Calibration:
    """Fit a trial's policy to its spikes on the trial's backend."""
    exact = Exact.of(trial.settings)
    layers, gait = policy_layers(exact.policy), rehearse(trial, exact).observations
    return refitted(trial, layers, record_ranges(layers, gait), gait, walks(trial, exact))


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
