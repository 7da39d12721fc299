import mujoco
import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.description import ARM_JOINTS, DEFAULT_POSE, GAINS, JOINTS, load

# The roll and yaw joints of the two sides turn in opposite senses.
ODD = ("roll", "yaw")


@pytest.fixture(scope="module")
def model():
    return load()


def names(model, kind, count):
    return [getattr(model, kind)(i).name for i in range(count)]


def tensor(model, body):
    """Return inertia of a body about its centre of mass, in the body's frame."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body(body).iquat)
    axes = rotation.reshape(3, 3)
    return axes @ np.diag(model.body(body).inertia) @ axes.T


def test_joints_and_actuators_have_the_documented_order(model):
    assert names(model, "joint", model.njnt) == ["base", *JOINTS]
    assert names(model, "actuator", model.nu) == list(JOINTS)
    assert len(JOINTS) == 19
    assert list(model.jnt_qposadr[1:]) == list(range(7, 26))
    assert list(model.jnt_dofadr[1:]) == list(range(6, 25))


def test_arm_joints_are_the_right_arm_from_the_shoulder_outwards():
    assert JOINTS[-4:] == ARM_JOINTS
    assert ARM_JOINTS == (
        "right_shoulder_pitch",
        "right_shoulder_roll",
        "right_shoulder_yaw",
        "right_elbow",
    )


def test_the_robot_weighs_what_unitree_published(model):
    assert model.body_subtreemass[0] == pytest.approx(51.437)


@pytest.mark.parametrize(
    ("joint", "low", "high", "torque_nm"),
    [
        ("left_hip_yaw", -0.43, 0.43, 200),
        ("right_hip_pitch", -1.57, 1.57, 200),
        ("left_knee", -0.26, 2.05, 300),
        ("right_ankle", -0.87, 0.52, 40),
        ("torso", -2.35, 2.35, 200),
        ("left_shoulder_roll", -0.34, 3.11, 40),
        ("right_shoulder_roll", -3.11, 0.34, 40),
        ("right_shoulder_yaw", -4.45, 1.3, 18),
        ("right_elbow", -1.25, 2.61, 18),
    ],
)
def test_joints_have_the_documented_ranges_and_torque_limits(model, joint, low, high, torque_nm):
    assert list(model.joint(joint).range) == [low, high]
    assert list(model.actuator(joint).forcerange) == [-torque_nm, torque_nm]
    assert model.joint(joint).damping[0] == 1
    assert model.joint(joint).armature[0] == 0.1


def test_left_and_right_limbs_are_mirror_images(model):
    mirror = np.diag([1.0, -1.0, 1.0])
    lefts = [n for n in names(model, "body", model.nbody) if n.startswith("left_")]
    assert len(lefts) == 9
    for left in lefts:
        right = left.replace("left_", "right_")
        assert model.body(left).mass == model.body(right).mass
        np.testing.assert_allclose(model.body(right).ipos, mirror @ model.body(left).ipos)
        expected = mirror @ tensor(model, left) @ mirror
        np.testing.assert_allclose(tensor(model, right), expected, atol=1e-12)


def mirrored(joint, angle):
    """Return the joint of the other side and the angle that makes it the mirror image."""
    if joint == "torso":
        return joint, -angle
    side, role = joint.split("_", 1)
    other = {"left": "right", "right": "left"}[side]
    return f"{other}_{role}", -angle if role.endswith(ODD) else angle


def hands(model, angles):
    data = mujoco.MjData(model)
    for joint, angle in angles.items():
        data.joint(joint).qpos = angle
    mujoco.mj_kinematics(model, data)
    return data.site("left_hand").xpos, data.site("right_hand").xpos


def test_mirrored_joint_angles_give_mirrored_positions(model):
    angles = dict(zip(JOINTS, np.random.RandomState(0).uniform(-1, 1, 19), strict=True))
    left, right = hands(model, angles)
    other_left, other_right = hands(model, dict(mirrored(*item) for item in angles.items()))
    np.testing.assert_allclose(other_right, left * [1, -1, 1], atol=1e-12)
    np.testing.assert_allclose(other_left, right * [1, -1, 1], atol=1e-12)


def test_left_and_right_ranges_are_mirror_images(model):
    for left in (j for j in JOINTS if j.startswith("left_")):
        low, high = model.joint(left).range
        expected = [-high, -low] if left.endswith(ODD) else [low, high]
        assert list(model.joint(left.replace("left_", "right_")).range) == expected


def test_each_foot_has_a_heel_and_a_toe_at_one_height(model):
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bottoms = []
    for name in ("left_heel", "left_toe", "right_heel", "right_toe"):
        placed = data.geom(name).xpos[2] - model.geom(name).size[0]
        bottoms.append(placed)
        assert model.geom(name).conaffinity == 1
    np.testing.assert_allclose(bottoms, bottoms[0], atol=1e-9)


def test_visual_shapes_touch_nothing_and_weigh_nothing(model):
    visual = model.geom_group == 2
    assert visual.sum() > 50
    assert not model.geom_contype[visual].any()
    assert not model.geom_conaffinity[visual].any()


def test_default_pose_and_gains_are_those_of_the_walking_policies():
    assert tuple(DEFAULT_POSE) == tuple(GAINS) == JOINTS
    assert DEFAULT_POSE["left_hip_pitch"] == DEFAULT_POSE["right_hip_pitch"] == -0.28
    assert DEFAULT_POSE["left_knee"] == 0.79
    assert DEFAULT_POSE["right_ankle"] == -0.52
    assert DEFAULT_POSE["right_shoulder_pitch"] == 0.28
    assert DEFAULT_POSE["left_elbow"] == 0.52
    assert sum(angle != 0 for angle in DEFAULT_POSE.values()) == 10
    assert GAINS["left_hip_roll"] == (150, 5)
    assert GAINS["torso"] == GAINS["right_knee"] == (200, 5)
    assert GAINS["left_ankle"] == (20, 4)
    assert GAINS["right_shoulder_yaw"] == (40, 10)


def test_default_pose_lies_in_the_ranges(model):
    pose = np.array(list(DEFAULT_POSE.values()))
    low, high = model.jnt_range[1:].T
    assert ((low < pose) & (pose < high)).all()


def test_unknown_appearance_lists_the_known_ones():
    with pytest.raises(UsageError) as error:
        load("gold")
    assert str(error.value) == "unknown appearance 'gold'; choose from: menagerie, primitive"
