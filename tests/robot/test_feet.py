import numpy as np
import pytest

from spikeport.robot.engine import mujoco
from spikeport.robot.feet import Feet
from spikeport.robot.plant import Plant


@pytest.fixture(scope="module")
def plant():
    return Plant()


def on_floor(plant, **angles_rad):
    """Return whether each foot touches the floor in a pose, the pelvis at standing height."""
    plant.reset(0, perturbation_rad=0.0)
    plant.data.qpos[2] -= 0.001
    for joint, angle_rad in angles_rad.items():
        plant.data.joint(joint).qpos[0] = angle_rad
    mujoco.mj_forward(plant.model, plant.data)
    return Feet(plant.model).on_floor(plant.data).tolist()


def test_a_standing_robot_has_both_feet_on_the_floor(plant):
    assert on_floor(plant) == [True, True]


def test_a_bent_knee_lifts_its_foot(plant):
    assert on_floor(plant, left_knee=1.6) == [False, True]
    assert on_floor(plant, right_knee=1.6) == [True, False]


@pytest.mark.parametrize("hip_roll_rad", [0.0, 0.25])
def test_a_robot_in_the_air_has_no_foot_on_the_floor(plant, hip_roll_rad):
    plant.reset(0)
    plant.data.qpos[2] += 0.5
    plant.data.joint("left_hip_roll").qpos -= hip_roll_rad
    plant.data.joint("right_hip_roll").qpos += hip_roll_rad
    mujoco.mj_forward(plant.model, plant.data)
    assert (plant.data.ncon > 0) == (hip_roll_rad > 0)  # toes touch each other
    assert not np.any(Feet(plant.model).on_floor(plant.data))
