"""The controller of a walking robot: a path follower, and a policy that obeys it."""

from collections.abc import Sequence

import nengo
import numpy as np

from spikeport.experiments.walk.settings import WalkSettings
from spikeport.networks.path_follower import FollowerNetwork
from spikeport.networks.policy import PolicyNetwork
from spikeport.networks.silencing import silence
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.node_functions import Held

WATCHED = 96
"""The number of ensembles, in all layers, whose spikes are kept if some are silenced."""


class WalkController(nengo.Network):
    """A follower and a policy in one network.

    Its inputs are ``observation``, ``reference`` and ``state``, its outputs ``action`` and
    ``command``.
    """

    observation: nengo.Node
    reference: nengo.Node
    state: nengo.Node
    action: nengo.Node
    command: nengo.Node


def walk_controller(follower: FollowerNetwork, walker: PolicyNetwork, seed: int) -> WalkController:
    """Put a follower and a policy into one network; neither is in another yet."""
    net = WalkController(label="controller", seed=seed)
    with net:
        net.add(follower)
        net.add(walker)
    net.observation, net.action = walker.observation, walker.action
    net.reference, net.state, net.command = follower.reference, follower.state, follower.command
    return net


def silence_ensembles(
    controller: WalkController, walker: PolicyNetwork, settings: WalkSettings
) -> Sequence[nengo.Probe]:
    """Silence a share of the policy's ensembles, and probe a neuron of every eighth or so."""
    ensembles = list(walker.all_ensembles)
    # not by an even stride, since halves for either sign alternate
    watched = np.linspace(0, len(ensembles) - 1, WATCHED).astype(int)
    seed = settings.network_seed
    silence(walker, settings.silence, settings.silence_at, settings.tau_fwd, seed)
    with controller:
        return [nengo.Probe(ensembles[i].neurons[:1]) for i in watched]


def analytic_policy(policy: WalkingPolicy) -> PolicyNetwork:
    """Build the policy without neurons: the exact actions, one step late."""
    net = PolicyNetwork(label="analytic policy")
    with net:
        net.observation = nengo.Node(Held(policy), size_in=policy.weights[0].shape[1])
        net.action = nengo.Node(size_in=len(policy.joints), label="action")
        nengo.Connection(net.observation, net.action, synapse=0)  # a step of delay: no loop
    return net
