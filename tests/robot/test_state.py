"""The motion that the robot's own sensors would measure."""

import numpy as np
import pytest

from spikeport.robot import state
from spikeport.robot.engine import mujoco
from spikeport.robot.plant import Plant


def test_velocities_are_in_the_frame_of_the_pelvis():
    data = Plant().data
    data.qpos[:7] = 1, 2, 3, np.sqrt(0.5), 0, 0, np.sqrt(0.5)  # a quarter turn to the left
    data.qvel[:6] = 0, 2, 0.5, 0.1, 0.2, 0.3
    data.qpos[7:], data.qvel[6:] = np.arange(19), -np.arange(19)
    mujoco.mj_kinematics(data.model, data)
    found = state.read(data)
    assert found.base_position.tolist() == [1, 2, 3]
    assert found.base_linear_velocity == pytest.approx([2, 0, 0.5])  # straight ahead
    assert found.base_angular_velocity.tolist() == [0.1, 0.2, 0.3]
    assert (found.q.tolist(), found.dq.tolist()) == (list(range(19)), [-i for i in range(19)])


def test_a_state_is_a_copy():
    data = Plant().data
    found = state.read(data)
    before = found.q.copy()
    data.qpos[:] = 7
    assert np.array_equal(found.q, before)


def test_a_state_in_the_plane_is_in_the_frame_of_the_world():
    plant = Plant()
    plant.data.qpos[:7] = 1, -2, 3, np.cos(1.0), 0.1, -0.2, np.sin(1.0)
    plant.data.qpos[3:7] /= np.linalg.norm(plant.data.qpos[3:7])
    plant.data.qvel[:6] = 0.4, -0.3, 0.2, 1.0, 2.0, 3.0
    mujoco.mj_forward(plant.model, plant.data)
    found = state.in_plane(plant.state)
    assert found[0] == pytest.approx(2.0, abs=0.1)
    assert found[1:] == pytest.approx([1.0, -2.0, 0.4, -0.3])
    assert found == pytest.approx(plant.true_in_plane)
