"""A robot's motion as its controller knows it."""

import numpy as np
import pytest

from spikeport.robot.perturbation import Perturbation
from spikeport.robot.plant import Plant
from spikeport.robot.senses import WIDTHS, Senses
from spikeport.robot.state import read


@pytest.fixture
def plant():
    made = Plant()
    made.reset(0)
    made.data.qvel[:6] = [0.4, -0.2, 0.1, 0.5, -0.6, 0.7]
    return made


def senses(plant, delay_steps=0, **perturbed):
    return Senses(plant, Perturbation(**perturbed), delay_steps, np.random.RandomState(0))


def test_without_noise_the_motion_is_the_truth(plant):
    known = senses(plant)
    plant.step()
    known.look()
    np.testing.assert_array_equal(known.state.q, read(plant.data).q)
    np.testing.assert_array_equal(
        known.state.base_linear_velocity, read(plant.data).base_linear_velocity
    )


def test_observations_are_late(plant):
    known, motions = senses(plant, delay_steps=3), [read(plant.data)]
    for _ in range(5):
        plant.step()
        known.look()
        motions.append(read(plant.data))
    np.testing.assert_array_equal(known.state.dq, motions[-4].dq)


def test_noise_is_within_its_widths(plant):
    known, off = senses(plant, sensor_noise=1.0), []
    for _ in range(200):
        known.look()
        off.append(known.state.dq - read(plant.data).dq)
    off = np.abs(np.array(off))
    assert off.max() <= WIDTHS.dq
    assert off.max() > 0.9 * WIDTHS.dq


def test_an_estimator_begins_at_the_robots_place(plant):
    known = senses(plant, estimator="ekf")
    np.testing.assert_allclose(known.state.base_position, plant.data.qpos[:3], atol=0.02)
    assert known.in_plane[0] == pytest.approx(plant.in_plane[0], abs=0.02)
