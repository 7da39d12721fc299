"""The robot's motion by the truth of a simulation, as it was published.

Angles, rates and orientation come from the sensors. Only place and linear velocity of the pelvis,
which no sensor observes, come from the simulation.
"""

import numpy as np

from spikeport.errors import RobotLostError
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.legs import WAIST
from spikeport.robot.estimator.torso import pelvis_angular_velocity, pelvis_quaternion
from spikeport.robot.link.client import Observed
from spikeport.robot.state import RobotState


def true_state(observed: Observed) -> RobotState:
    """Return the true motion of the robot; raises RobotLostError if nobody publishes it."""
    sensors, truth = observed.sensors, observed.truth
    if truth is None:
        raise RobotLostError(
            "the robot does not publish place and velocity of its pelvis; give --estimator ekf, or "
            "serve a simulation with --truth"
        )
    waist_rad, waist_rad_s = float(sensors.q[WAIST]), float(sensors.dq[WAIST])
    quaternion = pelvis_quaternion(sensors.quaternion, waist_rad)
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    return RobotState(
        base_position=truth.position,
        base_quaternion=quaternion,
        # Published in the world, wanted in the pelvis' frame.
        base_linear_velocity=rotation.reshape(3, 3).T @ truth.velocity,
        base_angular_velocity=pelvis_angular_velocity(sensors.gyroscope, waist_rad, waist_rad_s),
        q=sensors.q,
        dq=sensors.dq,
    )
