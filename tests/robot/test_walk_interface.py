import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import (
    OBSERVATION_SIZE,
    PARTS,
    POSE_RAD,
    gravity,
    observation,
    targets_rad,
)

HALF = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("quaternion", "expected"),
    [
        ([1, 0, 0, 0], [0, 0, -1]),
        ([HALF, 0, 0, HALF], [0, 0, -1]),  # turned about the vertical
        ([HALF, HALF, 0, 0], [0, -1, 0]),  # on its right side
        ([HALF, 0, HALF, 0], [1, 0, 0]),  # on its face
    ],
)
def test_gravity_is_the_direction_of_down_in_the_frame_of_the_pelvis(quaternion, expected):
    np.testing.assert_allclose(gravity(quaternion), expected, atol=1e-12)


def test_the_parts_fill_the_observation():
    covered = np.concatenate([np.arange(OBSERVATION_SIZE)[part] for part in PARTS.values()])
    assert covered.tolist() == list(range(OBSERVATION_SIZE))


def test_observation_of_a_standing_robot():
    plant = Plant()
    plant.reset(0, perturbation_rad=0.0, posture_rad={"torso": 0.1})
    seen = observation(plant.state, [0.5, 0.0, -0.3], np.full(19, 0.25))
    expected = np.zeros(OBSERVATION_SIZE)
    expected[8] = -1
    expected[PARTS["command"]] = [0.5, 0.0, -0.3]
    expected[PARTS["joint angles"]][JOINTS.index("torso")] = 0.1
    expected[PARTS["last action"]] = 0.25
    np.testing.assert_allclose(seen, expected, atol=1e-12)


def test_an_action_moves_the_target_by_half_a_radian():
    np.testing.assert_allclose(targets_rad(np.ones((2, 19))), [POSE_RAD + 0.5] * 2)
