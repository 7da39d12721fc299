"""The sensors of a simulated robot, with or without the errors of real ones."""

from dataclasses import dataclass

import numpy as np

from spikeport.robot.description import JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.torso import IMU_OFFSET_M
from spikeport.robot.plant import Plant
from spikeport.robot.signals import Sensors

AT_REST_M_S2 = np.array([0.0, 0.0, 9.81])
"""Specific force at rest, upward, in the world frame: the opposite of free fall."""
_N = len(JOINTS)


@dataclass(frozen=True)
class SensorErrors:
    """Errors of sensors: standard deviations of white noise per sample, and of constant biases.

    Attributes
    ----------
    gyroscope, gyroscope_bias : float
        In rad/s.
    accelerometer, accelerometer_bias : float
        In m/s^2.
    q, dq : float
        The noise of joint angles and velocities, rad and rad/s.
    torque : float
        In N m.
    """

    gyroscope: float = 0.0
    gyroscope_bias: float = 0.0
    accelerometer: float = 0.0
    accelerometer_bias: float = 0.0
    q: float = 0.0
    dq: float = 0.0
    torque: float = 0.0


EXACT = SensorErrors()
"""Sensors without errors."""

ROUGH = SensorErrors(0.01, 0.005, 0.1, 0.05, 0.0005, 0.05, 1.0)
"""Errors larger than a real robot's should be; an H1's were not measured."""


class SimulatedSensors:
    """Sensors of a plant, read once after each of its steps.

    The accelerometer's value is the mean specific force since the last reading,
    a = R^T ((v_k - v_{k-1}) / dt + g e_z), with the velocity v of the IMU: the value of an IMU that
    integrates faster than it is read. The first reading is the value at rest.

    Parameters
    ----------
    plant : Plant
        The robot.
    errors : SensorErrors
        Errors to add.
    seed : int
        Seed of the errors.
    """

    def __init__(self, plant: Plant, errors: SensorErrors = EXACT, seed: int = 0) -> None:
        self._plant, self._errors = plant, errors
        self._torso = plant.model.body("torso_link").id
        self._rng = np.random.RandomState(seed)
        # Drawn once: a bias is constant over a run.
        self._gyroscope_bias = errors.gyroscope_bias * self._rng.standard_normal(3)
        self._accelerometer_bias = errors.accelerometer_bias * self._rng.standard_normal(3)
        self._last: tuple[float, np.ndarray] | None = None

    def read(self) -> Sensors:
        """Return the present values."""
        data, errors, time_s = self._plant.data, self._errors, self._plant.time_s
        rotation = data.xmat[self._torso].reshape(3, 3)
        quaternion = data.xquat[self._torso].copy()
        omega, velocity = self._motion(rotation)
        force = self._specific_force(time_s, velocity)
        return Sensors(
            time_s=time_s,
            quaternion=quaternion,
            gyroscope=rotation.T @ omega + self._gyroscope_bias + self._noise(errors.gyroscope, 3),
            accelerometer=rotation.T @ force
            + self._accelerometer_bias
            + self._noise(errors.accelerometer, 3),
            q=data.qpos[7:] + self._noise(errors.q, _N),
            dq=data.qvel[6:] + self._noise(errors.dq, _N),
            torque=data.actuator_force + self._noise(errors.torque, _N),
        )

    def _motion(self, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the angular velocity of the torso and velocity of the IMU in the world."""
        found = np.zeros(6)
        mujoco.mj_objectVelocity(
            self._plant.model, self._plant.data, mujoco.mjtObj.mjOBJ_XBODY, self._torso, found, 0
        )
        omega, velocity = found[:3], found[3:]
        # The IMU is not at the torso's origin, so the torso's rotation moves it.
        return omega, velocity + np.cross(omega, rotation @ IMU_OFFSET_M)

    def _specific_force(self, time_s: float, velocity: np.ndarray) -> np.ndarray:
        last, self._last = self._last, (time_s, velocity)
        if last is None or time_s <= last[0]:
            return AT_REST_M_S2
        return np.asarray((velocity - last[1]) / (time_s - last[0]) + AT_REST_M_S2)

    def _noise(self, deviation: float, size: int) -> np.ndarray:
        return deviation * self._rng.standard_normal(size)
