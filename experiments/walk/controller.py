"""What walks the robot: a path follower, and a policy that does what it says."""

import nengo
import numpy as np

from spikeport.errors import UsageError
from spikeport.experiments.policy.readout import calibrated, policy_layers
from spikeport.experiments.walk.gait import WALKS
from spikeport.experiments.walk.loop import LoopedNetwork
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.networks.held import Held
from spikeport.networks.path_follower import FollowerNetwork, analytic_follower, path_follower
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.policy import PolicyNetwork, policy, record_ranges
from spikeport.networks.silencing import silence
from spikeport.networks.walking_policy import WalkingPolicy

WATCHED = 96
"""Ensembles whose spikes are kept where some fall silent, from all layers."""


def walk_controller(trial: WalkTrial, weights: WalkingPolicy, gait: np.ndarray) -> LoopedNetwork:
    """The controller of a trial, its policy converted for the observations of a gait (n, 69)."""
    # both made before: a policy is calibrated in a network of its own
    follower, walker = _follower(trial), _policy(trial, weights, gait)
    with LoopedNetwork(label="controller", seed=trial.settings.network_seed) as net:
        net.add(follower)
        net.add(walker)
    net.observation, net.action = walker.observation, walker.action
    net.reference, net.state, net.command = follower.reference, follower.state, follower.command
    if trial.settings.silence:
        _silence(trial, net, walker)
    return net


def _silence(trial: WalkTrial, net: LoopedNetwork, walker: PolicyNetwork) -> None:
    """Silence a share of the policy's ensembles, and watch a neuron of every eighth or so."""
    settings = trial.settings
    if trial.exact_policy:
        raise UsageError(f"silence={settings.silence:g}: the exact policy has no neurons")
    ensembles = list(walker.all_ensembles)
    # not by an even stride: halves for either sign take turns
    watched = np.linspace(0, len(ensembles) - 1, WATCHED).astype(int)
    seed = settings.network_seed
    silence(walker, settings.silence, settings.silence_at, settings.tau_fwd, seed)
    with net:
        net.spikes = [nengo.Probe(ensembles[i].neurons[:1]) for i in watched]


def _follower(trial: WalkTrial) -> FollowerNetwork:
    if trial.exact_follower:
        return analytic_follower(FollowerGains())
    return path_follower(FollowerGains(), seed=trial.settings.network_seed)


def _policy(trial: WalkTrial, weights: WalkingPolicy, gait: np.ndarray) -> PolicyNetwork:
    if trial.exact_policy:
        return analytic_policy(weights)
    layers = policy_layers(weights)
    ranges = record_ranges(layers, gait)
    found = calibrated(trial, layers, ranges, gait, WALKS)
    settings = trial.settings
    return policy(layers, ranges, settings.policy_options, settings.network_seed, found, gait)


def analytic_policy(weights: WalkingPolicy) -> PolicyNetwork:
    """The policy without neurons: the exact actions, one step late."""
    with PolicyNetwork(label="analytic policy") as net:
        net.observation = nengo.Node(Held(weights), size_in=weights.weights[0].shape[1])
        net.action = nengo.Node(size_in=len(weights.joints), label="action")
        nengo.Connection(net.observation, net.action, synapse=0)  # a step of delay: no loop
    return net
