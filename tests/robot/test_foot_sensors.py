"""Sensors at the feet of a simulated robot."""

import numpy as np
import pytest

from spikeport.robot.description import JOINTS, MODEL_PATH
from spikeport.robot.engine import mujoco
from spikeport.robot.foot_sensors import VALUES, add_foot_sensors, readings
from spikeport.robot.perturbation import NONE
from spikeport.robot.perturbed_plant import PerturbedPlant
from spikeport.robot.walk_interface import POSE_RAD


def test_foot_sensors_come_after_the_robots_own_sensors_left_foot_first():
    spec = mujoco.MjSpec.from_file(str(MODEL_PATH))
    before = spec.compile().nsensordata
    add_foot_sensors(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.nsensordata == before + VALUES
    feet = readings(data.sensordata[-VALUES:])
    np.testing.assert_allclose(feet.points[0, 0], data.geom("left_heel").xpos)
    np.testing.assert_allclose(feet.points[1, 1], data.geom("right_toe").xpos)
    assert not feet.velocities.any()


def test_the_feet_of_a_standing_robot_carry_its_weight():
    plant = PerturbedPlant(NONE)
    plant.reset(0)
    plant.hold(JOINTS, POSE_RAD)
    forces_n = []
    # the robot stands for longer than these steps before it tips over
    for _ in range(100):
        plant.step()
        forces_n.append(readings(plant.data.sensordata[-VALUES:]).force_n.sum())
    weight_n = 9.81 * plant.model.body_mass.sum()
    assert np.mean(forces_n) == pytest.approx(weight_n, rel=0.05)


def test_a_batch_of_readings_equals_the_single_readings():
    values = np.random.default_rng(0).standard_normal((3, 5, VALUES))
    for together, alone in zip(readings(values), readings(values[2, 4]), strict=True):
        np.testing.assert_array_equal(together[2, 4], alone)
