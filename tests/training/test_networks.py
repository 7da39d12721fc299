import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

import torch

from spikeport.networks.walking_policy import load
from spikeport.robot.description import JOINTS
from spikeport.robot.mirror import JOINT, OBSERVATION, SCALAR
from spikeport.training.export import policy_of
from spikeport.training.networks import (
    NOISE_SIZE,
    MirrorGaussian,
    MirrorNetwork,
)

SCALE = torch.linspace(0.5, 2.0, 69)
SCALE = (SCALE + SCALE[torch.as_tensor(OBSERVATION.order)]) / 2


def network(outputs=JOINT, breaking=0.0):
    torch.manual_seed(0)
    return MirrorNetwork(OBSERVATION, outputs, SCALE, 1.0, breaking).double()


def observations(n=5):
    return np.random.default_rng(0).standard_normal((n, 69))


def output(net, x):
    return net(torch.as_tensor(x)).detach().numpy()


def test_the_actor_is_equivariant():
    actor, x = network(), observations()
    np.testing.assert_allclose(
        output(actor, OBSERVATION(x)), JOINT(output(actor, x)), rtol=0, atol=1e-13
    )


def test_the_critic_is_invariant():
    critic, x = network(SCALAR), observations()
    np.testing.assert_allclose(output(critic, OBSERVATION(x)), output(critic, x), atol=1e-13)


def test_the_first_bias_breaks_the_symmetry_if_asked_to():
    actor, x = network(breaking=0.15), observations()
    assert np.abs(output(actor, OBSERVATION(x)) - JOINT(output(actor, x))).max() > 1e-3
    assert actor.k.requires_grad
    assert not network().k.requires_grad


def test_the_export_is_an_ordinary_network_that_acts_the_same(tmp_path):
    actor, x = network(breaking=0.15).float(), observations().astype(np.float32)
    policy_of(actor).save(tmp_path / "policy.npz")
    policy = load(tmp_path / "policy.npz")
    assert [W.shape for W in policy.weights] == [(128, 69), (128, 128), (128, 128), (19, 128)]
    assert policy.joints == JOINTS
    np.testing.assert_allclose(policy(x), output(actor, x), atol=1e-6)


def test_hidden_noise_in_the_input_changes_the_output():
    actor, x = network(), observations()
    noise = 0.03 * np.random.default_rng(1).standard_normal((5, NOISE_SIZE))
    noisy = np.concatenate((x, noise), axis=1)
    assert np.abs(output(actor, noisy) - output(actor, x)).max() > 1e-3


def test_noise_grows_with_the_activity_of_a_unit():
    actor = network()
    for weights in (actor.A, *actor.B, *actor.C):
        weights.data.zero_()
    actor.c[2].data.fill_(3.0)
    noise = torch.zeros(1, NOISE_SIZE, dtype=torch.float64)
    noise[0, 256] = 0.05  # first unit of the third layer, which is at 3
    changed = actor(torch.cat((torch.zeros(1, 69), noise), dim=1)) - actor(
        torch.zeros(1, 69).double()
    )
    expected = 0.05 * (1 + 3.0) * actor.D[:, 0]
    np.testing.assert_allclose(changed[0].detach(), expected.detach(), atol=1e-12)


def spread(gaussian):
    """Return standard deviation of every joint's action."""
    gaussian.update(torch.zeros(2, 19))
    return dict(zip(JOINTS, gaussian.std[0].detach().tolist(), strict=True))


def test_the_spread_of_actions_is_symmetric_and_capped():
    gaussian = MirrorGaussian(19, init_std=0.5)
    gaussian.log_std_param.data[JOINTS.index("left_knee")] -= 1.0
    std = spread(gaussian)
    assert std["left_knee"] == std["right_knee"] == pytest.approx(0.5 * np.exp(-0.5))
    assert std["torso"] == pytest.approx(0.15)
    assert std["left_hip_yaw"] == pytest.approx(0.2)
    assert std["left_elbow"] == pytest.approx(0.5)


def test_joints_that_are_not_explored_hardly_move():
    gaussian = MirrorGaussian(19, init_std=0.5)
    gaussian.explore([joint != "left_elbow" for joint in JOINTS])
    std = spread(gaussian)
    assert std["left_elbow"] == pytest.approx(0.001)
    assert std["right_elbow"] == pytest.approx(0.5)
