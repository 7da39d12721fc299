"""Isaac Lab's description of the H1, and descriptions that would take for ever to read."""

from collections import deque

import pytest
import yaml

from spikeport.experiments.policy.settings import H1
from spikeport.networks.loading import isaac
from spikeport.robot import description as robot
from spikeport.robot.description import JOINTS
from tests.helpers.foreign import described


def breadth_first(model):
    """Return joints of a model, level by level away from the root."""
    waiting, found = deque([1]), []
    while waiting:
        body = waiting.popleft()
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        found += [model.joint(joint).name for joint in joints]
        waiting += [b for b in range(body + 1, model.nbody) if model.body_parentid[b] == body]
    return tuple(name for name in found if name in JOINTS)


def test_the_order_of_isaac_lab_is_breadth_first():
    assert breadth_first(robot.load()) == isaac.JOINTS


def test_the_h1_of_this_package_is_the_one_of_isaac_lab(environment):
    described = isaac.described(environment())
    assert sorted(described.joints) == sorted(H1.joints)
    assert described.gains == {joint: tuple(gain) for joint, gain in H1.gains.items()}
    assert described.pose_rad == H1.pose_rad
    assert described.action_scale_rad == H1.action_scale_rad


@pytest.mark.parametrize(
    "joints",
    [
        {"joint_names": [".*"], "joint_ids": slice(None)},
        {"joint_names": list(isaac.JOINTS), "preserve_order": True},
        {"joint_names": ".*", "joint_ids": list(range(19))},
        {"joint_names": None, "joint_ids": None},
    ],
)
def test_a_term_may_name_all_joints_in_their_order(environment, joints):
    term = "observations/policy/joint_vel"
    path = environment({f"{term}/params/asset_cfg": joints, f"{term}/modifiers": []})
    assert isaac.described(path).joints == isaac.JOINTS


@pytest.mark.parametrize(
    ("expression", "complaint"),
    [
        ("(.*)*(.*)*(.*)*(.*)*x", "simple regular expressions for names of joints"),
        ("((a+)+)+$", "simple regular expressions for names of joints"),
        (".*" * 20 + "x", "simple regular expressions for names of joints"),
        ("(|)" * 30 + "x", "simple regular expressions for names of joints"),
        (".{1,20}" * 4 + "x", "simple regular expressions for names of joints"),
        ("(?=.*)x", "simple regular expressions for names of joints"),
        ("a" * 1000, "simple regular expressions for names of joints"),
        (".*(a|aa|aaa|aaaa).*(a|b|c|d|e)x", "joints of the H1 in"),
        ("(", "a regular expression, found ("),
        ("[", "a regular expression, found ["),
    ],
)
def test_expressions_that_may_take_for_ever_are_refused(
    environment, refused, expression, complaint
):
    change = {"scene/robot/init_state/joint_pos": {expression: 0.1}}
    assert complaint in refused(environment(change), described)


def test_oversized_tables_are_refused(environment, refused):
    change = {"scene/robot/init_state/joint_pos": {f".*{n}": 0.1 for n in range(3000)}}
    assert "at most 100 items in robot.init_state.joint_pos" in refused(
        environment(change), described
    )


def test_a_joint_of_two_groups_of_actuators_is_refused(environment, refused):
    change = {"scene/robot/actuators/feet/joint_names_expr": [".*_ankle", "torso"]}
    assert "torso in one group of actuators, found it in actuators.feet, too" in refused(
        environment(change), described
    )


def test_aliases_that_isaac_lab_writes_are_read(environment):
    path = environment()
    content = yaml.unsafe_load(path.read_text())
    content["again"] = [content["sim"], content["sim"]]
    path.write_text(yaml.dump(content, sort_keys=False))
    assert "*id001" in path.read_text()
    assert isaac.described(path).control_dt_s == pytest.approx(0.02)
