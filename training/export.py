"""The trained actor, written out as an ordinary network."""

import numpy as np

from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.description import JOINTS
from spikeport.robot.walk_interface import ACTION_SCALE_RAD, POSE_RAD
from spikeport.training.networks import MirrorNetwork


def policy_of(actor: MirrorNetwork) -> WalkingPolicy:
    """Return the actor with its tied weights and input scales written out."""
    layers = [(W.detach().numpy(), b.detach().numpy()) for W, b in actor.layers()]
    weights, biases = zip(*layers, strict=True)
    return WalkingPolicy(weights, biases, JOINTS, np.copy(POSE_RAD), ACTION_SCALE_RAD)
