import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spikeport.experiments.arm.reach_task import SHOULDER_M
from spikeport.experiments.switch.frames import ANCHORED_PELVIS_M, Frame

LEANING = Frame(
    np.array([2.0, 1.0, 0.9]),
    Rotation.from_euler("ZYX", (0.7, 0.2, -0.1)).as_matrix(),
    ANCHORED_PELVIS_M,
)


def test_places_in_a_frame_map_back_to_the_same_places_in_the_world():
    points = np.random.RandomState(0).normal(size=(5, 3))
    assert LEANING.world(LEANING.local(points)) == pytest.approx(points)
    assert LEANING.local(LEANING.origin) == pytest.approx([0, 0, 1.06])
    assert LEANING.local(LEANING.origin + LEANING.rotation[:, 0]) == pytest.approx([1, 0, 1.06])


def test_an_upright_frame_keeps_heading_and_shoulder():
    upright, shoulder = LEANING.upright(), np.array(SHOULDER_M)
    assert upright.world(shoulder) == pytest.approx(LEANING.world(shoulder))
    assert upright.rotation[:, 2].tolist() == [0, 0, 1]
    assert np.arctan2(*upright.rotation[1::-1, 0]) == pytest.approx(0.7)
    again = upright.upright()
    assert again.local(shoulder + 0.3) == pytest.approx(upright.local(shoulder + 0.3))


def test_a_frame_follows_another_with_a_time_constant_of_one_second():
    frame, other = Frame(np.zeros(3), np.eye(3), np.zeros(3)), LEANING.upright()
    for _ in range(200):
        frame = frame.following(other, 0.005)
    gone = 1 - 0.995**200
    assert frame.origin == pytest.approx(gone * other.origin)
    assert 0.4 < np.arctan2(*frame.rotation[1::-1, 0]) < 0.7
    assert frame.rotation @ frame.rotation.T == pytest.approx(np.eye(3))
