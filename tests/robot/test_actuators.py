"""Torque and position control of joints."""

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot import actuators, description
from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco


def test_joints_are_indexed_by_name_and_unknown_names_are_refused():
    names = ["torso", JOINTS[0]]
    assert actuators.indices(names).tolist() == [JOINTS.index("torso"), 0]
    with pytest.raises(UsageError, match=r"^unknown joint 'tail'; choose from: "):
        actuators.indices(["tail"])


def test_one_number_serves_all_joints():
    assert actuators.values("kp", 3, ("a", "b")).tolist() == [3, 3]
    assert actuators.values("kp", [1, 2], ("a", "b")).tolist() == [1, 2]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([1, 2, 3], "kp: shape (3,) for 2 joints; give one number per joint"),
        ([[1, 2]], "kp: shape (1, 2) for 2 joints; give one number per joint"),
        ([1, np.inf], "kp: inf for joint 'b'; give finite numbers"),
    ],
)
def test_numbers_that_do_not_fit_the_joints_are_refused(given, message):
    with pytest.raises(UsageError) as caught:
        actuators.values("kp", given, ("a", "b"))
    assert str(caught.value) == message


def test_torques_follow_the_control_mode_of_each_joint():
    model = description.load()
    data = mujoco.MjData(model)
    hip, knee = actuators.indices(["left_hip_pitch", "left_knee"])
    actuators.set_torque_mode(model, np.array([hip]))
    actuators.set_position_mode(model, np.array([knee]), np.array([20.0]), np.array([0.5]))
    data.qpos[7 + knee], data.qvel[6 + knee] = 0.3, 2.0
    data.ctrl[[hip, knee]] = 7.0, 0.8
    mujoco.mj_forward(model, data)
    assert data.actuator_force[hip] == pytest.approx(7.0)
    assert data.actuator_force[knee] == pytest.approx(20 * (0.8 - 0.3) - 0.5 * 2.0)
    actuators.set_torque_mode(model, np.array([knee]))
    mujoco.mj_forward(model, data)
    assert data.actuator_force[knee] == pytest.approx(0.8)
