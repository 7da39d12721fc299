import mujoco
import numpy as np

from spikeport.robot import mirror
from spikeport.robot.description import JOINTS
from spikeport.training import model
from spikeport.training.observation import PRIVILEGED


def test_the_mirror_image_of_the_mirror_image_is_the_original():
    x = np.random.default_rng(0).standard_normal((3, len(PRIVILEGED.order)))
    assert (PRIVILEGED(PRIVILEGED(x)) == x).all()


def test_mirroring_swaps_the_sides_of_joints_and_negates_yaw():
    q = np.zeros(19)
    q[[JOINTS.index("left_knee"), JOINTS.index("left_hip_yaw"), JOINTS.index("torso")]] = 1, 2, 3
    image = dict(zip(JOINTS, mirror.JOINT(q), strict=True))
    assert {joint: value for joint, value in image.items() if value} == {
        "right_knee": 1,
        "right_hip_yaw": -2,
        "torso": -3,
    }


def test_the_robot_in_a_mirrored_posture_is_the_mirror_image():
    robot = model.build_model()
    q = np.random.default_rng(1).uniform(-0.3, 0.3, 19)
    left = hand_and_heels(robot, q)
    right = hand_and_heels(robot, mirror.JOINT(q))
    np.testing.assert_allclose(left, right[[1, 0, 3, 2]] * [1, -1, 1], atol=1e-5)


def hand_and_heels(robot, q):
    data = mujoco.MjData(robot)
    data.qpos[7:] = q
    mujoco.mj_kinematics(robot, data)
    sites = [data.site(f"{side}_hand").xpos for side in ("left", "right")]
    heels = [data.geom(f"{side}_heel").xpos for side in ("left", "right")]
    return np.array([*sites, *heels]) - data.qpos[:3]
