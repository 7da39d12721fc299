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


@pytest.mark.parametrize(
    ("board_m", "touches"),
    [((0.025, 0.1), True), ((-0.1, -0.025), True), ((-0.01, 0.01), True), ((0.04, 0.1), False)],
)
def test_the_lowest_sole_counts_from_the_floor_at_a_capsules_ends_and_middle(
    plant, board_m, touches
):
    plant.reset(0, perturbation_rad=0.0)
    toe = plant.data.geom("left_toe").xpos.copy()

    def floor_m(place):
        """Return the height of a board of 3 cm under a part of the left toe, across the foot."""
        on_board = place[0] > toe[0] - 0.05 and board_m[0] < place[1] - toe[1] < board_m[1]
        return 0.03 if on_board else 0.0

    sole = Feet(plant.model).sole(plant.data, floor_m, is_plane=False)
    assert sole.floor_m == (0.03 if touches else 0.0)
    assert sole.above_m == pytest.approx(-sole.floor_m, abs=3e-3)
