"""Isaac Lab's H1, as its description has it."""

from collections import deque

from spikeport.experiments.policy.settings import H1
from spikeport.networks.loading import isaac
from spikeport.robot import description as robot
from spikeport.robot.description import JOINTS


def breadth_first(model):
    """Joints of a model, level by level away from the root."""
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
