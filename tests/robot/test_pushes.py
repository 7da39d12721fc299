"""Pushes of one strength at drawn times."""

import numpy as np

from spikeport.robot.pushes import Pushes


def test_pushes_have_one_strength_and_come_about_as_often_as_asked_for():
    pushes = Pushes(0.8, 5.0, np.random.RandomState(0))
    found = [pushes.due(time_s) for time_s in np.arange(0, 1000, 0.1)]
    due = np.array([push for push in found if push is not None])
    np.testing.assert_allclose(np.linalg.norm(due, axis=1), 0.8)
    assert 180 < len(due) < 220
    assert np.abs(due.mean(axis=0)).max() < 0.15


def test_a_strength_of_0_makes_no_push_due():
    assert Pushes(0.0, 5.0, np.random.RandomState(0)).due(1e9) is None
