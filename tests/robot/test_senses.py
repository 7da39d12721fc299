"""A robot's motion as its controller knows it."""

import numpy as np
import pytest

from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.simulated_sensors import ROUGH
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


def test_observations_are_late_by_the_delay_in_steps(plant):
    known, motions = senses(plant, delay_steps=3), [read(plant.data)]
    for _ in range(5):
        plant.step()
        known.look()
        motions.append(read(plant.data))
    np.testing.assert_array_equal(known.state.dq, motions[-4].dq)


@pytest.mark.parametrize(
    ("name", "width"),
    [
        ("base_linear_velocity", WIDTHS.linear_velocity),
        ("base_angular_velocity", WIDTHS.angular_velocity),
        ("q", WIDTHS.q),
        ("dq", WIDTHS.dq),
    ],
)
def test_noise_fills_its_width_and_stays_within_it(plant, name, width):
    known, off, true = senses(plant, sensor_noise=2.0), [], getattr(read(plant.data), name)
    for _ in range(200):
        known.look()
        off.append(np.abs(getattr(known.state, name) - true))
    assert 0.9 * 2 * width < np.max(off) <= 2 * width


def test_noise_of_the_attitude_changes_the_tilt_and_not_the_heading(plant):
    known, tilts, true = senses(plant, sensor_noise=1.0), [], read(plant.data).base_quaternion
    for _ in range(200):
        known.look()
        quaternion, turn, back = known.state.base_quaternion, np.empty(4), np.empty(4)
        mujoco.mju_negQuat(back, true)
        mujoco.mju_mulQuat(turn, back, quaternion)
        assert np.linalg.norm(quaternion) == pytest.approx(1.0)
        tilts.append(2 * turn[1:])
    largest = np.abs(tilts).max(axis=0)
    np.testing.assert_allclose(largest, [WIDTHS.tilt, WIDTHS.tilt, 0.0], rtol=0.1, atol=1e-12)


def test_sensor_errors_of_an_estimator_scale_with_the_noise(plant):
    def deviation(noise):
        made = senses(plant, sensor_noise=noise, estimator="leg-odometry")
        off = []
        for _ in range(100):
            made.look()
            off.append(made.state.q - read(plant.data).q)
        return np.std(off)

    assert deviation(0.0) == 0.0
    assert deviation(1.0) == pytest.approx(ROUGH.q, rel=0.1)
    assert deviation(3.0) == pytest.approx(3 * ROUGH.q, rel=0.1)


def test_an_estimator_begins_at_the_robots_place(plant):
    plant.data.qpos[:2], plant.data.qpos[3:7] = (3.0, -2.0), (np.cos(0.4), 0, 0, np.sin(0.4))
    mujoco.mj_forward(plant.model, plant.data)
    known = senses(plant, estimator="ekf")
    assert known.in_plane[0] == pytest.approx(0.8, abs=0.02)
    np.testing.assert_allclose(known.state.base_position, plant.data.qpos[:3], atol=0.02)
    assert known.in_plane[0] == pytest.approx(plant.in_plane[0], abs=0.02)
