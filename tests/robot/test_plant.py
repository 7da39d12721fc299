import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.description import ARM_JOINTS, DEFAULT_POSE, JOINTS
from spikeport.robot.plant import Plant

POSE = np.array(list(DEFAULT_POSE.values()))
ELBOW = JOINTS.index("right_elbow")
WEIGHT_N = 51.437 * 9.81


@pytest.fixture(scope="module")
def free_plant():
    return Plant()


@pytest.fixture(scope="module")
def anchored_plant():
    return Plant(anchored=True)


@pytest.fixture
def free(free_plant):
    free_plant.reset(0)
    return free_plant


@pytest.fixture
def anchored(anchored_plant):
    anchored_plant.reset(0)
    return anchored_plant


def run(plant, seconds):
    for _ in range(round(seconds / plant.dt_s)):
        plant.step()


def trajectory(plant, seed, seconds=0.25):
    plant.reset(seed)
    run(plant, seconds)
    return np.concatenate((plant.data.qpos, plant.data.qvel))


def test_time_advances_by_5_ms(free):
    assert free.dt_s == 0.005
    assert free.time_s == 0
    run(free, 0.05)
    assert free.time_s == pytest.approx(0.05)


def test_damping_brakes_joints_but_does_not_hold_them(anchored):
    anchored.data.qvel[6:] = 1.0
    anchored.damp()
    anchored.step()
    kd = -anchored.model.actuator_biasprm[:, 2]
    np.testing.assert_array_equal(kd, 8.0)
    np.testing.assert_array_equal(anchored.model.actuator_gainprm[:, 0], 0.0)
    run(anchored, 3.0)
    assert np.abs(anchored.data.qvel[6:]).max() < 0.2
    assert abs(anchored.data.qpos[7:][ELBOW] - POSE[ELBOW]) > 0.1  # nothing holds it up


def test_reset_is_reproducible_bit_for_bit(free):
    first = trajectory(free, 3)
    free.torque(JOINTS, 1e3)
    free.anchor()
    assert (trajectory(free, 3) == first).all()
    assert (trajectory(Plant(), 3) == first).all()
    assert (trajectory(free, 4) != first).any()


def test_reset_moves_every_joint_by_at_most_the_perturbation(free):
    for seed in range(5):
        free.reset(seed)
        moved = np.abs(free.state.q - POSE)
        assert (moved > 0).all()
        assert moved.max() <= 0.02
    free.reset(0, perturbation_rad=0.0)
    np.testing.assert_array_equal(free.state.q, POSE)


def test_a_free_robot_starts_on_its_soles(free):
    free.step()
    assert 0.9 < free.state.base_position[2] < 1.0
    run(free, 0.1)
    assert free.data.ncon >= 3


def test_an_anchored_robot_starts_upright_at_its_published_height(anchored):
    assert anchored.anchored
    np.testing.assert_array_equal(anchored.state.base_position, [0, 0, 1.06])
    assert anchored.state.q[JOINTS.index("torso")] == 0


def test_torque_is_held_between_steps_and_clipped(anchored):
    anchored.torque(["right_elbow", "left_knee"], [100.0, -5.0])
    assert anchored.data.actuator("right_elbow").ctrl[0] == 18
    for _ in range(10):
        anchored.step()
        assert anchored.data.actuator("right_elbow").force[0] == 18
        assert anchored.data.actuator("left_knee").force[0] == -5
    anchored.torque(["right_elbow"], [0.0])
    anchored.step()
    assert anchored.data.actuator("right_elbow").force[0] == 0
    assert anchored.data.actuator("left_knee").force[0] == -5


def test_hold_is_a_spring_and_a_damper(anchored):
    anchored.hold(["right_elbow"], [0.6], kp=[30.0], kd=[2.0])
    for _ in range(10):
        before = anchored.state
        anchored.step()
        expected = 30 * (0.6 - before.q[ELBOW]) - 2 * before.dq[ELBOW]
        assert anchored.data.actuator("right_elbow").force[0] == pytest.approx(expected)


def test_hold_uses_the_default_gains_and_the_torque_limits(anchored):
    before = anchored.state.q[ELBOW]
    anchored.hold(["right_elbow"], before + 0.1)
    anchored.step()
    assert anchored.data.actuator("right_elbow").force[0] == pytest.approx(40 * 0.1)
    anchored.hold(["right_elbow"], 100.0)
    anchored.step()
    assert anchored.data.actuator("right_elbow").force[0] == 18


def test_hold_brings_a_joint_to_its_target(anchored):
    anchored.hold(ARM_JOINTS, [0.0, -0.3, 0.2, 1.0], kp=300.0, kd=30.0)
    run(anchored, 2.0)
    np.testing.assert_allclose(anchored.state.q[-4:], [0.0, -0.3, 0.2, 1.0], atol=0.03)
    assert np.abs(anchored.state.dq[-4:]).max() < 1e-3


def test_torque_replaces_hold_and_hold_replaces_torque(anchored):
    anchored.torque(["right_elbow"], 3.0)
    anchored.hold(["right_elbow"], anchored.state.q[ELBOW], kp=10.0, kd=0.0)
    anchored.step()
    assert anchored.data.actuator("right_elbow").force[0] == pytest.approx(0.0, abs=1e-12)
    anchored.torque(["right_elbow"], 3.0)
    anchored.step()
    assert anchored.data.actuator("right_elbow").force[0] == 3


def test_joints_switch_between_hold_and_torque_in_changing_groups(anchored):
    """A joint's mode is its own, whether it is commanded alone or with others."""
    both = ["right_elbow", "left_knee"]
    for joints in (both, ["right_elbow"], both, ["left_knee", "right_elbow"]):
        anchored.torque(joints, 3.0)
        anchored.step()
        assert anchored.data.actuator("right_elbow").force[0] == 3
        anchored.hold(both, anchored.state.q[[ELBOW, JOINTS.index("left_knee")]])
        anchored.torque(["left_knee"], 3.0)
        anchored.step()
        assert anchored.data.actuator("left_knee").force[0] == 3
        assert anchored.data.actuator("right_elbow").force[0] != 3


def test_gravity_torque_holds_the_arm_still(anchored):
    arm = ArmDynamics()
    anchored.reset(0, perturbation_rad=0.0)
    start = anchored.state.q[-4:]
    for _ in range(200):
        anchored.torque(ARM_JOINTS, arm.at(anchored.state.q[-4:]).gravity)
        anchored.step()
    np.testing.assert_allclose(anchored.state.q[-4:], start, atol=2e-3)
    anchored.torque(ARM_JOINTS, 0.0)
    run(anchored, 1.0)
    assert np.abs(anchored.state.q[-4:] - start).max() > 0.1


def test_the_pelvis_stays_while_the_arm_moves_hard(anchored):
    rng = np.random.RandomState(0)
    drift = 0.0
    for step in range(400):
        if step % 40 == 0:
            anchored.torque(ARM_JOINTS, rng.choice([-40.0, 40.0], 4))
        anchored.step()
        drift = max(drift, np.abs(anchored.state.base_position - [0, 0, 1.06]).max())
    assert np.ptp(anchored.history()["qpos"][:, -4:], axis=0).min() > 0.5
    assert drift < 1e-3
    assert abs(anchored.state.q[JOINTS.index("torso")]) < 1e-3


def test_a_free_robot_without_torque_falls(free):
    start = free.state.base_position[2]
    free.torque(JOINTS, 0.0)
    run(free, 0.1)
    in_the_air = 0.5 * 9.81 * 0.1**2
    assert 0 < start - free.state.base_position[2] < in_the_air
    run(free, 1.4)
    assert free.state.base_position[2] < 0.5


def test_the_feet_carry_a_robot_that_holds_its_pose(free):
    free.hold(JOINTS, POSE, kp=2000.0, kd=100.0)
    start = free.state.base_position
    run(free, 0.4)
    assert np.abs(free.state.base_position - start).max() < 0.02
    vertical_n = free.data.qfrc_constraint[2]
    assert vertical_n == pytest.approx(WEIGHT_N, rel=0.1)


def test_anchor_welds_where_the_robot_is_and_release_lets_go(free):
    free.data.joint("torso").qpos = 0.3
    free.anchor()
    welded = free.state.base_position
    free.torque(JOINTS, 0.0)
    run(free, 0.5)
    np.testing.assert_allclose(free.state.base_position, welded, atol=1e-3)
    assert free.state.q[JOINTS.index("torso")] == pytest.approx(0.3, abs=1e-3)
    free.release()
    assert not free.anchored
    run(free, 0.5)
    assert free.state.base_position[2] < welded[2] - 0.1


def test_state_agrees_with_the_imu_of_a_tumbling_robot(free):
    free.data.qvel[:6] = [0.5, -0.3, 1.0, 0.7, -0.4, 0.9]
    free.torque(JOINTS, 0.0)
    run(free, 0.3)
    state = free.state
    assert np.abs(state.base_linear_velocity - free.data.qvel[:3]).max() > 0.05
    for sensor, value in [
        ("imu_velocity", state.base_linear_velocity),
        ("imu_gyro", state.base_angular_velocity),
        ("imu_orientation", state.base_quaternion),
    ]:
        np.testing.assert_allclose(free.data.sensor(sensor).data, value, atol=1e-9)


def test_state_is_a_copy(free):
    before = free.state
    kept = [value.copy() for value in before]
    run(free, 0.05)
    for value, old in zip(before, kept, strict=True):
        np.testing.assert_array_equal(value, old)


def test_hand_position_is_that_of_the_current_state(anchored):
    arm = ArmDynamics()
    anchored.torque(ARM_JOINTS, [5.0, -5.0, 2.0, 2.0])
    run(anchored, 0.2)
    expected = arm.at(anchored.state.q[-4:]).position
    np.testing.assert_allclose(anchored.hand_position(), expected, atol=1e-4)
    assert anchored.hand_position("left")[1] > 0.1


def test_history_holds_the_last_200_states_oldest_first(free):
    free.hold(["torso"], 0.25)
    assert free.history()["time_s"].tolist() == [0]
    run(free, 1.25)
    history = free.history()
    np.testing.assert_allclose(history["time_s"], 0.255 + 0.005 * np.arange(200))
    np.testing.assert_array_equal(history["qpos"][-1], free.data.qpos)
    np.testing.assert_array_equal(history["qvel"][-1], free.data.qvel)
    assert (history["ctrl"][:, JOINTS.index("torso")] == 0.25).all()
    assert history["qpos"].shape == (200, 26)


def test_unknown_names_list_the_known_ones(free):
    joints = ", ".join(sorted(JOINTS))
    for command in (free.hold, free.torque):
        with pytest.raises(UsageError) as error:
            command(["right_elbow", "left_wing"], [0.0, 0.0])
        assert str(error.value) == f"unknown joint 'left_wing'; choose from: {joints}"
    with pytest.raises(UsageError) as error:
        free.hand_position("upper")
    assert str(error.value) == "unknown side 'upper'; choose from: left, right"


def test_commands_need_one_finite_number_per_joint(free):
    before = free.data.ctrl.copy()
    with pytest.raises(UsageError) as error:
        free.torque(ARM_JOINTS, [1.0, 2.0])
    assert str(error.value) == "torques_nm: shape (2,) for 4 joints; give one number per joint"
    with pytest.raises(UsageError) as error:
        free.hold(["torso"], [np.nan])
    assert str(error.value) == "targets_rad: nan for joint 'torso'; give finite numbers"
    np.testing.assert_array_equal(free.data.ctrl, before)


def test_motion_returns_the_named_joints_in_their_order():
    plant = Plant(anchored=True)
    plant.step()
    q, dq = plant.motion(("right_elbow", "left_knee"))
    state, places = plant.state, [JOINTS.index("right_elbow"), JOINTS.index("left_knee")]
    assert q.tolist() == state.q[places].tolist()
    assert dq.tolist() == state.dq[places].tolist()


def test_a_robot_can_be_anchored_at_a_pose_near_its_own(free):
    pose = np.add(free.data.qpos[:7], [0.01, 0, 0.02, 0, 0, 0, 0])
    free.anchor(pose, torso_rad=0.05)
    run(free, 0.3)
    assert free.data.qpos[:7] == pytest.approx(pose, abs=2e-3)
    assert free.data.joint("torso").qpos[0] == pytest.approx(0.05, abs=5e-3)
