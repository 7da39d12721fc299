"""A robot's motion as its controller observes it: estimated, noisy and delayed.

With the truth, the noise is uniform within ``sensor_noise`` times `WIDTHS`, the widths that Isaac
Lab's velocity tasks add to observations; their noise on gravity is a tilt of the pelvis here. With
an estimator, the sensors have the noise: ``sensor_noise`` times `ROUGH` of
`spikeport.robot.estimator.simulated_sensors`.
"""

from collections import deque
from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.base import Fix, StateEstimator
from spikeport.robot.estimator.registry import BY_SENSORS, TRUTH
from spikeport.robot.estimator.simulated_sensors import ROUGH, SensorErrors, SimulatedSensors
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.plant import Plant
from spikeport.robot.state import RobotState, in_plane, read


class Widths(NamedTuple):
    """Half widths of uniform noise: m/s, rad/s, rad, rad and rad/s."""

    linear_velocity: float = 0.1
    angular_velocity: float = 0.2
    tilt: float = 0.05
    q: float = 0.01
    dq: float = 1.5


WIDTHS = Widths()
"""Source: Isaac Lab, ``LocomotionVelocityRoughEnvCfg``, its observations' noise."""


class Senses:
    """The senses of a robot in a run, which begins at the robot's present state.

    Parameters
    ----------
    plant : Plant
        The robot.
    perturbation : Perturbation
        Its estimator, noise and delay of observations.
    delay_steps : int
        Delay of observations, in steps of the physics.
    rng : numpy.random.RandomState
        Draws the noise.
    """

    def __init__(
        self,
        plant: Plant,
        perturbation: Perturbation,
        delay_steps: int,
        rng: np.random.RandomState,
    ) -> None:
        self._plant, self._data, self._rng = plant, plant.data, rng
        self._noise = perturbation.sensor_noise
        self._estimator: StateEstimator | None = None
        if perturbation.estimator != TRUTH:
            errors = {name: self._noise * rough for name, rough in asdict(ROUGH).items()}
            self._sensors = SimulatedSensors(plant, SensorErrors(**errors), rng.randint(2**31))
            self._estimator = BY_SENSORS[perturbation.estimator]()
        # The truth of now needs no look in steps in which nobody observes it.
        self._on_demand = self._estimator is None and not self._noise and not delay_steps
        # Filled with the first observation: until the delay has passed, sensors read the start.
        self._late = deque([self._begun()] * (delay_steps + 1), delay_steps + 1)

    @property
    def state(self) -> RobotState:
        """The motion as observed now."""
        if not self._late:
            self._late.append(read(self._data))
        return self._late[0]

    @property
    def in_plane(self) -> np.ndarray:
        """Heading in rad, place in m and velocity in m/s, (5,), as observed now."""
        # Exactly the truth: turned into the pelvis' frame and back, it would differ by rounding.
        return self._plant.true_in_plane if self._on_demand else in_plane(self.state)

    def look(self) -> None:
        """Observe the robot, after a step of its physics."""
        if self._on_demand:
            self._late.clear()
        elif self._estimator is None:
            self._late.append(self._noisy(read(self._data)))
        else:
            self._late.append(self._estimator.update(self._sensors.read()))

    def _begun(self) -> RobotState:
        true = read(self._data)
        if self._estimator is None:
            return self._noisy(true)
        heading_rad = float(in_plane(true)[0])
        return self._estimator.reset(self._sensors.read(), Fix(true.base_position, heading_rad))

    def _noisy(self, true: RobotState) -> RobotState:
        if not self._noise:
            return true
        quaternion = np.empty(4)
        # The vector part of a small rotation's quaternion is half its angle.
        tilt = np.array([1.0, *self._drawn(WIDTHS.tilt / 2, 2), 0.0])
        mujoco.mju_mulQuat(quaternion, true.base_quaternion, tilt / np.linalg.norm(tilt))
        return RobotState(
            base_position=true.base_position,
            base_quaternion=quaternion,
            base_linear_velocity=true.base_linear_velocity + self._drawn(WIDTHS.linear_velocity, 3),
            base_angular_velocity=true.base_angular_velocity
            + self._drawn(WIDTHS.angular_velocity, 3),
            q=true.q + self._drawn(WIDTHS.q, len(true.q)),
            dq=true.dq + self._drawn(WIDTHS.dq, len(true.dq)),
        )

    def _drawn(self, width: float, size: int) -> np.ndarray:
        return self._noise * width * self._rng.uniform(-1, 1, size)
