"""A whole run: start on the hoist, release, a walk on an estimate of the motion, and stop."""

import numpy as np
import pytest

from spikeport.networks.walking_policy import load
from spikeport.robot.description import GAINS, JOINTS
from spikeport.robot.estimator.contact_aided_ekf import ContactAidedEkf
from spikeport.robot.estimator.simulated_sensors import ROUGH, SimulatedSensors
from spikeport.robot.link.controller import Controller
from spikeport.robot.link.controller_states import State
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands, Sensors
from spikeport.robot.walk_interface import observation, targets_rad
from tests.helpers.standing_robot import POSE_RAD, N, remote

AHEAD = (0.5, 0.0, 0.0)
STEPS = 4
"""Physics steps from one action to the next."""


class Day:
    """A plant behind a controller, one state every 5 ms."""

    def __init__(self) -> None:
        self.plant = Plant()
        self.plant.anchor()
        self.sensors = SimulatedSensors(self.plant, ROUGH, seed=1)
        self.ekf, self.policy = ContactAidedEkf(), load()
        self.action, self.steps = np.zeros(N), 0
        self.controller = Controller(self.walk)

    def walk(self, sensors: Sensors) -> MotorCommands:
        if self.steps == 0:
            self.ekf.reset(sensors)
        state = self.ekf.update(sensors)
        if self.steps % STEPS == 0:
            self.action = self.policy(observation(state, AHEAD, self.action))
        self.steps += 1
        kp, kd = np.array([GAINS[joint] for joint in JOINTS]).T
        return MotorCommands(targets_rad(self.action), np.zeros(N), kp, kd, np.zeros(N))

    def spend(self, seconds: float, *keys: str) -> None:
        """Run for a time, with keys pressed in its first step."""
        for step in range(round(seconds / self.plant.dt_s)):
            time_s = self.plant.time_s
            pressed = remote(*keys * (step == 0))
            motors = self.controller.answer(self.sensors.read(), pressed, time_s)
            self.plant.hold(JOINTS, motors.q, motors.kp, motors.kd)
            self.plant.step()

    @property
    def height_m(self) -> float:
        return float(self.plant.data.qpos[2])


@pytest.mark.slow
def test_a_robot_is_started_on_its_hoist_released_walks_and_is_stopped():
    day = Day()
    day.spend(0.5)
    assert day.controller.state is State.ZERO_TORQUE
    hanging = np.abs(day.plant.data.qpos[7:] - POSE_RAD).max()
    day.spend(2.5, "start")
    assert day.controller.state is State.HOLD
    assert np.abs(day.plant.data.qpos[7:] - POSE_RAD).max() < min(0.1, hanging / 2)
    day.plant.release()
    day.spend(5.0, "A")
    assert day.controller.state is State.RUN, day.controller.refused
    assert day.height_m > 0.9
    assert np.linalg.norm(day.plant.data.qpos[:2]) > 1.5
    day.spend(1.5, "select")
    assert day.controller.state is State.DAMPING
    assert day.height_m < 0.7  # damping does not keep a robot standing
    assert day.controller.refusals == 0
