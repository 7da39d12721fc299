import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.simulated_sensors import (
    AT_REST_M_S2,
    EXACT,
    ROUGH,
    SensorErrors,
    SimulatedSensors,
)
from spikeport.robot.estimator.torso import IMU_OFFSET_M, rotation
from spikeport.robot.plant import Plant


def moved(read: bool) -> tuple[np.ndarray, np.ndarray]:
    plant = Plant()
    sensors = SimulatedSensors(plant)
    for _ in range(100):
        if read:
            sensors.read()
        plant.step()
    return plant.data.qpos, plant.data.qvel


def test_reading_the_sensors_does_not_change_a_bit_of_a_run():
    for with_, without in zip(moved(True), moved(False), strict=True):
        np.testing.assert_array_equal(with_, without)


def test_a_robot_that_hangs_still_feels_its_weight():
    plant = Plant(anchored=True)
    sensors = SimulatedSensors(plant)
    sensors.read()
    for _ in range(400):
        plant.step()
        found = sensors.read()
    np.testing.assert_allclose(found.accelerometer, AT_REST_M_S2, atol=0.02)
    np.testing.assert_allclose(found.gyroscope, 0.0, atol=2e-3)
    np.testing.assert_array_equal(found.q, plant.data.qpos[7:])
    np.testing.assert_array_equal(found.dq, plant.data.qvel[6:])
    np.testing.assert_array_equal(found.torque, plant.data.actuator_force)


def test_a_robot_in_free_fall_feels_no_weight():
    plant = Plant()
    plant.data.qpos[2] += 10.0
    mujoco.mj_forward(plant.model, plant.data)
    sensors = SimulatedSensors(plant)
    sensors.read()
    for _ in range(20):
        plant.step()
        found = sensors.read()
    assert np.linalg.norm(found.accelerometer) < 0.5  # joints still move


def test_accelerometer_readings_integrate_to_the_imus_velocity():
    plant, dt_s = Plant(), 0.005
    sensors = SimulatedSensors(plant)
    body = plant.data.body("torso_link")
    sensors.read()

    def place() -> np.ndarray:
        return body.xpos + body.xmat.reshape(3, 3) @ IMU_OFFSET_M

    places, velocity = [place()], np.zeros(3)
    for _ in range(60):
        plant.step()
        found = sensors.read()
        force = rotation(found.quaternion) @ found.accelerometer
        velocity = velocity + (force - AT_REST_M_S2) * dt_s
        places.append(place())
    np.testing.assert_allclose((places[-1] - places[-3]) / (2 * dt_s), velocity, atol=0.02)


@pytest.mark.slow
def test_errors_have_the_stated_deviations_and_follow_from_the_seed():
    plant = Plant(anchored=True)
    errors = SensorErrors(0.1, 0.0, 0.2, 0.0, 0.3, 0.4, 0.5)
    exact = SimulatedSensors(plant).read()
    one, again = (SimulatedSensors(plant, errors, seed=1) for _ in range(2))
    apart: dict[str, list[np.ndarray]] = {name: [] for name in exact._fields[2:]}
    for _ in range(2000):
        found, same = one.read(), again.read()
        for name, values in apart.items():
            values.append(getattr(found, name) - getattr(exact, name))
            np.testing.assert_array_equal(getattr(found, name), getattr(same, name))
    sizes = [np.std(values) for values in apart.values()]
    np.testing.assert_allclose(sizes, [0.1, 0.2, 0.3, 0.4, 0.5], rtol=0.05)


def test_biases_are_constant_during_a_run():
    plant = Plant(anchored=True)
    sensors = SimulatedSensors(plant, SensorErrors(gyroscope_bias=0.1, accelerometer_bias=0.2))
    exact, first, second = SimulatedSensors(plant).read(), sensors.read(), sensors.read()
    np.testing.assert_array_equal(first.gyroscope, second.gyroscope)
    assert np.abs(first.gyroscope - exact.gyroscope).max() > 0.01
    assert np.abs(first.accelerometer - exact.accelerometer).max() > 0.01


@pytest.mark.parametrize("errors", [EXACT, ROUGH])
def test_readings_have_the_sizes_of_messages(errors):
    found = SimulatedSensors(Plant(), errors).read()
    assert [np.size(v) for v in found] == [1, 4, 3, 3, *3 * (len(JOINTS),)]
