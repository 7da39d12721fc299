"""Foreign walking policies, which are translated or refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from spikeport.errors import UsageError
from spikeport.experiments.policy.settings import PolicySettings, load_policy
from spikeport.networks import walking_policy
from spikeport.networks.loading import isaac
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.description import JOINTS

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
N = len(JOINTS)
WITH = "; see docs/convert.md, 'Refused policies'"


def test_our_own_file_is_read_with_its_joints_by_name(tmp_path):
    shipped = walking_policy.load()
    order = np.random.default_rng(0).permutation(N)
    columns = [*range(12), *(start + i for start in (12, 31, 50) for i in order)]
    (first, *others), biases = shipped.weights, list(shipped.biases)
    weights = (first[:, columns], *others[:-1], others[-1][order])
    biases[-1] = biases[-1][order]
    joints = tuple(JOINTS[i] for i in order)
    moved = replace(shipped, weights=weights, biases=tuple(biases), joints=joints)
    replace(moved, pose_rad=shipped.pose_rad[order]).save(tmp_path / "moved.npz")
    policy, x = load_policy(tmp_path / "moved.npz"), np.linspace(-1, 1, 69)
    np.testing.assert_allclose(policy(x), shipped(x))
    assert policy.joints == JOINTS


def test_the_shipped_policy_is_read_as_it_is():
    x = np.linspace(-1, 1, 69)
    np.testing.assert_allclose(load_policy()(x), walking_policy.load()(x))


def refused(path, description=None):
    with pytest.raises(UsageError) as error:
        load_policy(path, description)
    return str(error.value)


@pytest.mark.parametrize(
    ("layers", "complaint"),
    [
        (
            [nn.Linear(48, 8), nn.ELU(), nn.Linear(8, 12)],
            "expected 69 observations and 19 actions, found 48 observations and 12 actions",
        ),
        ([nn.Linear(69, 8), nn.GELU(), nn.Linear(8, N)], "expected activation elu, found gelu"),
        (
            [nn.Hardtanh(), nn.Linear(69, 8), nn.ELU(), nn.Linear(8, N)],
            "expected an observation without a clip, found one with a clip",
        ),
        (
            [nn.Linear(69, 8), nn.ELU(), nn.Linear(8, N), nn.Tanh(), nn.Hardtanh()],
            "expected a linear last layer, found tanh and clip behind it",
        ),
    ],
)
def test_a_policy_of_another_form_is_refused(tmp_path, environment, layers, complaint):
    path = tmp_path / "policy.pt"
    torch.jit.script(nn.Sequential(*layers)).save(path)
    assert refused(path, environment()) == f"policy file '{path}': {complaint}{WITH}"


def test_a_foreign_policy_needs_its_description(path):
    assert refused(path) == (
        f"policy file '{path}': expected Isaac Lab's environment description with it, found none; "
        "give it with --description env.yaml"
    )


def test_a_run_without_a_description_names_its_own_option_for_one(path):
    with pytest.raises(UsageError, match=r"found none; give it with --set description=env\.yaml$"):
        PolicySettings(policy=str(path)).walking_policy()


def test_an_activation_passed_for_a_checkpoint_is_used(tmp_path, environment):
    layers = nn.Sequential(nn.Linear(69, 8), nn.ELU(), nn.Linear(8, N)).state_dict()
    state = {f"mlp.{name}": value for name, value in layers.items()}
    state["distribution.std_param"] = torch.ones(N)
    path = tmp_path / "model.pt"
    torch.save({"actor_state_dict": state}, path)
    assert load_policy(path, environment(), "elu").weights[0].shape == (8, 69)
    with pytest.raises(UsageError, match="expected activation elu, found gelu"):
        load_policy(path, environment(), "gelu")


def test_a_file_of_ours_keeps_the_gains_of_its_follower(tmp_path):
    path, gains = tmp_path / "policy.npz", FollowerGains(kp_speed=1.1, kp_heading=3.5)
    replace(walking_policy.load(), gains=gains).save(path)
    assert load_policy(path).gains == gains


def test_a_file_of_ours_takes_no_description(tmp_path):
    walking_policy.load().save(tmp_path / "policy.npz")
    path = tmp_path / "policy.npz"
    with pytest.raises(UsageError) as caught:
        load_policy(path, Path("env.yaml"))
    assert str(caught.value) == (
        f"description 'env.yaml': policy '{path}' needs none; cure: leave the description out"
    )


def test_a_file_of_ours_for_other_joints_is_refused(tmp_path):
    path, rng = tmp_path / "policy.npz", np.random.default_rng(0)
    weights = (rng.standard_normal((4, 18)), rng.standard_normal((2, 4)))
    WalkingPolicy(weights, (np.zeros(4), np.zeros(2)), ("hip", "knee"), np.zeros(2), 0.5).save(path)
    assert refused(path) == (
        f"policy file '{path}': expected the joints {', '.join(JOINTS)}, "
        f"found 2 joints, foreign: hip, knee{WITH}"
    )


LEGS = "scene/robot/actuators/legs"
ACTION = "actions/joint_pos"
TERM = "observations/policy"
JOINTS_OF = f"{TERM}/joint_pos/params/asset_cfg"
OTHER_JOINTS = (
    "expected all joints in observations.policy.joint_pos, in the order of Isaac Lab's "
    "articulation, found others"
)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"sim/dt": 0.0025}, "expected an action every 0.02 s, found 0.01 s"),
        (
            {f"{LEGS}/stiffness/.*_knee": 150.0},
            "expected gains kp 200, kd 5 of left_knee, found kp 150, kd 5",
        ),
        (
            {f"{ACTION}/scale": 0.0},
            "expected a finite action scale above 0 of left_hip_yaw, found 0",
        ),
        (
            {f"{ACTION}/scale": float("inf")},
            "expected a finite action scale above 0 of left_hip_yaw, found inf",
        ),
        (
            {"scene/robot/init_state/joint_pos": float("nan")},
            "expected a finite default pose of left_hip_yaw, found nan",
        ),
        (
            {f"{TERM}/joint_vel/scale": float("nan")},
            "expected finite scales of the observation, found NaN or infinity",
        ),
        (
            {f"{LEGS}/stiffness/left_knee": 150.0},
            "expected one value of left_knee in actuators.legs, found 2",
        ),
        (
            {f"{LEGS}/joint_names_expr": [".*_hip_yaw"]},
            "expected stiffness and damping of torso, found none",
        ),
        (
            {"scene/robot/init_state/joint_pos": {".*_hip_pitch_joint": -0.2}},
            "expected joints of the H1 in robot.init_state.joint_pos, found .*_hip_pitch_joint",
        ),
        (
            {f"{ACTION}/class_type": "isaaclab.envs.mdp.actions.joint_actions:JointEffortAction"},
            "expected one action, a JointPositionAction, found JointEffortAction",
        ),
        (
            {f"{ACTION}/joint_names": ["left_.*", "torso"]},
            "expected an action for every joint, found left_.*, torso",
        ),
        (
            {f"{ACTION}/preserve_order": True},
            "expected a description of Isaac Lab (actions.joint_pos.preserve_order: Input should "
            "be False), found True",
        ),
        (
            {f"{TERM}/base_lin_vel": None},
            f"expected the observation {', '.join(isaac.TERMS)}, "
            f"found {', '.join(list(isaac.TERMS)[1:])}",
        ),
        (
            {f"{TERM}/joint_pos/history_length": 3},
            "expected a description of Isaac Lab (history_length: Input should be 0 or None), "
            "found 3",
        ),
        (
            {f"{TERM}/joint_pos/modifiers": [{"func": "isaaclab.utils.modifiers:scale"}]},
            "expected a description of Isaac Lab (modifiers: List should have at most 0 items "
            "after validation, not 1), found list",
        ),
        (
            {f"{JOINTS_OF}/joint_names": [".*_hip_.*", ".*"], f"{JOINTS_OF}/preserve_order": True},
            OTHER_JOINTS,
        ),
        ({f"{JOINTS_OF}/joint_names": "left_.*"}, OTHER_JOINTS),
        ({f"{JOINTS_OF}/joint_ids": [*range(18, -1, -1)]}, OTHER_JOINTS),
        (
            {"scene": {}},
            "expected a description of Isaac Lab (scene.robot: Field required), found none",
        ),
    ],
)
def test_another_robot_or_task_is_refused(path, environment, changes, complaint):
    description = environment(changes)
    assert refused(path, description) == f"description '{description}': {complaint}{WITH}"
