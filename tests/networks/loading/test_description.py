"""A policy that is translated from another robot's description."""

import numpy as np
import pytest
import torch

from spikeport.experiments.policy.settings import H1, load_policy
from spikeport.networks import walking_policy
from spikeport.networks.loading import isaac
from spikeport.networks.loading.walking import our_observations
from spikeport.robot.description import DEFAULT_POSE, JOINTS
from spikeport.robot.walk_interface import targets_rad

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")


N = len(JOINTS)


POSE = np.array([DEFAULT_POSE[joint] for joint in JOINTS])


CHANGES = {
    "scene/robot/init_state/joint_pos": {".*_knee": 0.5, "left_elbow": 0.1},
    "actions/joint_pos/scale": {".*_knee": 0.25, "torso": 0.1},
    "observations/policy/base_ang_vel/scale": 0.2,
    "observations/policy/joint_vel/scale": 0.05,
}


def both_targets(policy, module, pose, action_scale, observation_scale=1.0):
    """Return joint targets in our order, of the policy and of the module with its own robot."""
    rng = np.random.default_rng(2)
    head, q, dq = rng.standard_normal(12), POSE + rng.standard_normal(N), rng.standard_normal(N)
    before = rng.standard_normal(N)
    ours = targets_rad(policy(np.concatenate((head, q - POSE, dq, before))))
    order = [JOINTS.index(joint) for joint in isaac.JOINTS]
    last = (targets_rad(before) - pose) / action_scale
    parts = (head, (q - pose)[order], dq[order], last[order])
    with torch.no_grad():
        action = module(torch.tensor(np.concatenate(parts) * observation_scale)).numpy()
    theirs = np.empty(N)
    theirs[order] = action
    return ours, pose + action_scale * theirs


def test_an_isaac_lab_policy_moves_our_joints_as_it_moved_its_own(path, module, environment):
    policy = load_policy(path, environment())
    assert policy.joints == JOINTS
    np.testing.assert_allclose(*both_targets(policy, module, POSE, 0.5), atol=1e-6)


def test_another_pose_and_other_scales_are_folded_in(path, module, environment):
    policy = load_policy(path, environment(CHANGES))
    pose = np.array([0.5 * j.endswith("knee") + 0.1 * (j == "left_elbow") for j in JOINTS])
    scale = np.array([{"torso": 0.1}.get(j, 0.25 if j.endswith("knee") else 1) for j in JOINTS])
    factor = np.repeat([1, 0.2, 1, 0.05, 1], [3, 3, 6 + N, N, N])
    np.testing.assert_allclose(*both_targets(policy, module, pose, scale, factor), atol=1e-6)
    np.testing.assert_allclose(policy.pose_rad, POSE)
    assert policy.action_scale_rad == 0.5


def test_observations_are_translated_as_the_first_layer_is(path, module, environment):
    theirs = np.random.default_rng(3).standard_normal((20, 12 + 3 * N))
    ours = our_observations(theirs, H1, path, environment(CHANGES))
    policy = load_policy(path, environment(CHANGES))
    with torch.no_grad():
        wanted = module[0](torch.tensor(theirs)).numpy()
    np.testing.assert_allclose(ours @ policy.weights[0].T + policy.biases[0], wanted, atol=1e-6)


def test_observations_of_our_own_robot_keep_every_bit():
    own = np.random.default_rng(3).standard_normal((20, 12 + 3 * N))
    assert our_observations(own, H1, walking_policy.SHIPPED, None).tolist() == own.tolist()


def test_an_observation_with_a_scale_of_0_is_0(path, environment):
    place = "observations/policy/base_ang_vel/scale"
    described = environment({place: 0.0})
    ours = our_observations(np.ones((2, 12 + 3 * N)), H1, path, described)
    assert ours[:, 3:6].tolist() == [[0.0] * 3] * 2
