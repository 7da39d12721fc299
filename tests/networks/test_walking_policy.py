from dataclasses import replace

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.networks.activations import elu
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.walking_policy import WalkingPolicy, load

CURE = "; make one with: spikeport train walk"


@pytest.fixture
def policy():
    rng = np.random.default_rng(0)
    shapes = [(4, 3), (4, 4), (2, 4)]
    weights = tuple(rng.standard_normal(shape) for shape in shapes)
    biases = tuple(rng.standard_normal(rows) for rows, _ in shapes)
    return WalkingPolicy(weights, biases, ("left", "right"), np.array([0.1, 0.2]), 0.5)


def test_the_last_layer_is_linear(policy):
    W, b = policy.weights, policy.biases
    x = np.array([1.0, -2.0, 0.5])
    hidden = elu(W[1] @ elu(W[0] @ x + b[0]) + b[1])
    np.testing.assert_allclose(policy(x), W[2] @ hidden + b[2])
    np.testing.assert_allclose(policy(np.stack((x, x))), [policy(x)] * 2)


def test_layers_have_the_weights_and_biases(policy):
    for layer, W, b in zip(policy.layers, policy.weights, policy.biases, strict=True):
        assert layer.weights is W
        assert layer.bias is b


def test_a_saved_policy_is_loaded_as_it_was(policy, tmp_path):
    policy.save(tmp_path / "policy.npz")
    again = load(tmp_path / "policy.npz")
    x = np.ones(3)
    assert (again(x) == policy(x)).all()
    assert again.joints == policy.joints
    assert again.action_scale_rad == policy.action_scale_rad
    assert (again.pose_rad == policy.pose_rad).all()


def test_gains_are_saved_with_a_policy(policy, tmp_path):
    gains = FollowerGains(kp_speed=1.1, kp_heading=3.7)
    replace(policy, gains=gains).save(tmp_path / "policy.npz")
    assert load(tmp_path / "policy.npz").gains == gains


def test_a_policy_without_gains_has_the_default_ones():
    assert load().gains == FollowerGains()


def broken(policy, **changes):
    return replace(policy, **{name: tuple(value) for name, value in changes.items()})


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (
            lambda p: broken(p, weights=[p.weights[0], p.weights[1][:, :3], p.weights[2]]),
            "expected weights_1 of shape (4, 4), found (4, 3)",
        ),
        (
            lambda p: broken(p, biases=[p.biases[0] * np.nan, *p.biases[1:]]),
            "expected finite numbers, found NaN or infinity in layer 0",
        ),
        (
            lambda p: broken(p, joints=["left"]),
            "expected one action and one angle of the pose per joint, found 2 actions, 1 joints",
        ),
        (
            lambda p: broken(p, biases=p.biases[:2]),
            "expected biases of 3 layers, found no biases_2",
        ),
        (
            lambda p: broken(p, joints=["left", "left"]),
            "expected distinct joints, found 1 repeated",
        ),
        (
            lambda p: replace(p, pose_rad=np.nan * p.pose_rad),
            "expected finite angles in pose_rad, found NaN or infinity",
        ),
        (
            lambda p: replace(p, gains=FollowerGains(kp_heading=-1.0)),
            "expected two follower_gains above 0 and up to 20 /s, found 1.25, -1",
        ),
        (
            lambda p: replace(p, gains=FollowerGains(kp_speed=np.nan)),
            "expected two follower_gains above 0 and up to 20 /s, found nan, 2.8",
        ),
        (
            lambda p: replace(p, action_scale_rad=0.0),
            "expected a finite action_scale_rad above 0, found 0",
        ),
    ],
)
def test_a_policy_that_does_not_fit_is_refused(policy, tmp_path, change, complaint):
    path = tmp_path / "policy.npz"
    change(policy).save(path)
    with pytest.raises(UsageError) as error:
        load(path)
    assert str(error.value) == f"policy file '{path}': {complaint}{CURE}"


def test_an_npz_of_other_arrays_is_refused(tmp_path):
    path = tmp_path / "policy.npz"
    np.savez(path, x=np.zeros(3))
    with pytest.raises(UsageError) as error:
        load(path)
    expected = "weights, biases and joints, pose_rad, action_scale_rad, activation"
    assert str(error.value) == (
        f"policy file '{path}': expected {expected}, found arrays missing{CURE}"
    )


def test_a_text_is_refused(tmp_path):
    path = tmp_path / "policy.npz"
    path.write_text("not a policy")
    with pytest.raises(UsageError, match="expected a whole zip archive"):
        load(path)
