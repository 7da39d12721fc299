"""The robot's motion from messages, which is the simulation's up to float32."""

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.robot import state
from spikeport.robot.link.client import observed
from spikeport.robot.link.codec import Command
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.truth import true_state


def falling() -> SimulatedRobot:
    robot = SimulatedRobot(RobotSettings(posture_rad={"torso": 0.7}))
    for _ in range(80):
        robot.obey(Command(robot.tick, DAMPING))
        robot.step()
    return robot


def test_the_motion_of_a_falling_robot_equals_the_simulations() -> None:
    robot = falling()
    found, truth = true_state(observed(LockStep(robot).published())), state.read(robot._plant.data)
    assert np.abs(truth.base_angular_velocity).max() > 0.5
    if found.base_quaternion @ truth.base_quaternion < 0:
        found = found._replace(base_quaternion=-found.base_quaternion)
    for name, one, other in zip(found._fields, found, truth, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5, err_msg=name)


def test_a_robot_that_does_not_publish_the_truth_is_refused() -> None:
    with pytest.raises(RobotLostError, match="give --estimator ekf"):
        true_state(observed(LockStep(falling(), tells_truth=False).published()))
