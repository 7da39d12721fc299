"""The robot's motion from messages is that of the simulation, up to float32."""

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.robot import state
from spikeport.robot.link.client import observed
from spikeport.robot.link.codec import Command
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.robot import DAMPING, SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.truth import estimate


def falling() -> SimulatedRobot:
    robot = SimulatedRobot(RobotSettings(posture_rad={"torso": 0.7}))
    for _ in range(80):
        robot.obey(Command(robot.tick, DAMPING))
        robot.step()
    return robot


def test_a_falling_robots_motion_is_found() -> None:
    robot = falling()
    found, truth = estimate(observed(LockStep(robot).published())), state.read(robot._plant.data)
    assert np.abs(truth.base_angular_velocity).max() > 0.5
    if found.base_quaternion @ truth.base_quaternion < 0:
        found = found._replace(base_quaternion=-found.base_quaternion)
    for name, one, other in zip(found._fields, found, truth, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5, err_msg=name)


def test_a_robot_that_tells_no_truth_is_refused() -> None:
    with pytest.raises(RobotLostError, match="served with --truth"):
        estimate(observed(LockStep(falling(), tells_truth=False).published()))
